#include "host/particles/formats/ply_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <new>
#include <numbers>
#include <optional>
#include <sstream>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/formats/byte_stream.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/number_visit.h"
#include "host/particles/formats/text_number.h"

namespace mote {
namespace {

/// No writer comes near; it keeps what is read in front of the data small.
constexpr std::size_t kMostHeader = 1 << 20;
constexpr std::size_t kBlockBytes = 1 << 19;

std::optional<NumberType> typeNamed(const std::string& name) {
  constexpr struct {
    const char *old, *sized;
    NumberType type;
  } kTypes[] = {{"char", "int8", NumberType::I8},      {"uchar", "uint8", NumberType::U8},
                {"short", "int16", NumberType::I16},   {"ushort", "uint16", NumberType::U16},
                {"int", "int32", NumberType::I32},     {"uint", "uint32", NumberType::U32},
                {"float", "float32", NumberType::F32}, {"double", "float64", NumberType::F64}};
  for (const auto& t : kTypes)
    if (name == t.old || name == t.sized) return t.type;
  return std::nullopt;
}

}  // namespace

struct PlyReader::Property {
  std::string name;
  NumberType type = NumberType::F32;
  std::optional<NumberType> listSize{};
};

struct PlyReader::Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties{};
  bool isParticles() const { return name == "vertex" || name == "point" || name == "particle"; }
  bool hasLists() const {
    return std::any_of(properties.begin(), properties.end(), [](const Property& p) { return p.listSize.has_value(); });
  }
};

bool beginsAsPly(std::span<const std::byte> start) {
  return start.size() >= 4 && std::memcmp(start.data(), "ply", 3) == 0 &&
         ByteStream::isSpace(static_cast<int>(start[3]));
}

std::vector<PlyReader::Element> PlyReader::parseHeader() {
  ByteStream bytes(file_, 0);
  std::vector<Element> elements;
  std::size_t number = 0;
  bool hasFormat = false;
  const auto fail = [&](const std::string& expected, const std::string& got) {
    throw InputError(path_, fmt::format("PLY header, line {}", number), expected, "'" + got.substr(0, 60) + "'");
  };
  for (;;) {
    std::string line;
    int c = bytes.next();
    for (; c >= 0 && c != '\n' && bytes.position() <= kMostHeader; c = bytes.next()) line += static_cast<char>(c);
    ++number;
    if (c < 0 || bytes.position() > kMostHeader)
      throw InputError(path_, "PLY header", fmt::format("end_header within {} bytes", kMostHeader),
                       c < 0 ? "the file's end" : "more", "the file is cut off, or none of particles");
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (number == 1) {
      if (word != "ply") fail("ply", line);
    } else if (word == "end_header") {
      break;
    } else if (word == "format") {
      std::string encoding, version;
      words >> encoding >> version;
      hasFormat = true;
      if (encoding == "ascii")
        encoding_ = Encoding::Text;
      else if (encoding == "binary_little_endian")
        encoding_ = Encoding::LittleEndian;
      else if (encoding == "binary_big_endian")
        encoding_ = Encoding::BigEndian;
      else
        fail("ascii, binary_little_endian or binary_big_endian", line);
      if (version != "1.0") fail("format … 1.0", line);
      format_ = "PLY " + encoding;
    } else if (word == "element") {
      Element element;
      std::string count;
      words >> element.name >> count;
      const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
      if (count.empty() || error != std::errc() || end != count.data() + count.size()) fail("element NAME COUNT", line);
      elements.push_back(std::move(element));
    } else if (word == "property") {
      Property property;
      std::string type, size;
      words >> type;
      const bool list = type == "list";
      if (list) words >> size >> type;
      words >> property.name;
      const std::optional<NumberType> found = typeNamed(type), counts = typeNamed(size);
      if (elements.empty() || property.name.empty() || !found || (list && !counts))
        fail("property TYPE NAME behind an element", line);
      property.type = *found;
      if (list) property.listSize = counts;
      elements.back().properties.push_back(std::move(property));
    } else if (word != "comment" && word != "obj_info" && !word.empty()) {
      fail("format, element, property, comment, obj_info or end_header", line);
    }
  }
  if (!hasFormat) throw InputError(path_, "PLY header", "a line 'format …'", "none");
  dataBegin_ = bytes.position();
  return elements;
}

/// Steps over an element in front of the particles.
void PlyReader::skipElement(const Element& element) {
  const std::uint64_t left = file_.bytes() - dataBegin_;
  const auto cutOff = [&] {
    throw InputError(path_, fmt::format("element {}", element.name), fmt::format("{} of them", element.count),
                     "the file's end", "the file is cut off");
  };
  // A row is at least a byte.
  if (!element.properties.empty() && element.count > left) cutOff();
  if (element.properties.empty()) return;
  ByteStream bytes(file_, dataBegin_);
  if (encoding_ == Encoding::Text) {
    for (std::uint64_t row = 0; row < element.count; ++row)
      for (int c = bytes.next(); c != '\n'; c = bytes.next())
        if (c < 0) cutOff();
  } else if (!element.hasLists()) {
    std::uint64_t size = 0;
    for (const Property& p : element.properties) size += numberSize(p.type);
    if (element.count > left / size) cutOff();
    dataBegin_ += element.count * size;
    return;
  } else {
    const auto skip = [&](std::uint64_t count) {
      if (count > file_.bytes() - bytes.position()) cutOff();
      for (; count > 0; --count) bytes.next();
    };
    const auto length = [&](NumberType type) {
      std::byte raw[8];
      skip(0);
      for (std::size_t k = 0; k < numberSize(type); ++k) {
        const int c = bytes.next();
        if (c < 0) cutOff();
        raw[encoding_ == Encoding::BigEndian ? numberSize(type) - 1 - k : k] = static_cast<std::byte>(c);
      }
      return withNumberType(type, [&]<class T>(T) {
        T value;
        std::memcpy(&value, raw, sizeof value);
        if constexpr (std::is_integral_v<T>)
          return value > T(0) ? static_cast<std::uint64_t>(value) : std::uint64_t{0};
        else  // floats may be more than any integer
          return value > T(0) ? static_cast<std::uint64_t>(std::min(static_cast<double>(value), 0x1p63))
                              : std::uint64_t{0};
      });
    };
    for (std::uint64_t row = 0; row < element.count; ++row)
      for (const Property& p : element.properties) {
        const std::uint64_t numbers = p.listSize ? length(*p.listSize) : 1;
        if (numbers > file_.bytes()) cutOff();
        skip(numbers * numberSize(p.type));
      }
  }
  dataBegin_ = bytes.position();
}

PlyReader::PlyReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  const std::vector<Element> elements = parseHeader();
  const auto found = std::find_if(elements.begin(), elements.end(), [](const Element& e) { return e.isParticles(); });
  if (found == elements.end()) throw InputError(path_, "PLY header", "an element vertex, point or particle", "none");
  if (found->hasLists() || found->properties.empty())
    throw InputError(path_, fmt::format("element {}", found->name), "properties that are numbers",
                     found->properties.empty() ? "none" : "a list");
  for (auto element = elements.begin(); element != found; ++element) skipElement(*element);

  requireFewChannels(path_, found->properties.size());
  for (const Property& p : found->properties) {
    if (std::any_of(columns_.begin(), columns_.end(), [&](const auto& c) { return c.channel.name == p.name; }))
      throw InputError(path_, fmt::format("element {}", found->name), "properties of different names",
                       fmt::format("'{}' twice", p.name));
    columns_.emplace_back(p.name, p.type, 1, rowBytes_);
    rowBytes_ += numberSize(p.type);
  }
  placed_ = withVectors(columns_);
  for (const PlacedChannel& placed : placed_) channels_.push_back(placed.channel);
  count_ = found->count;
  const std::uint64_t left = file_.bytes() - dataBegin_;
  // A number in a text is at least a digit and what parts it from the next, but for the last one.
  const std::uint64_t least = encoding_ == Encoding::Text ? 2 * columns_.size() : rowBytes_;
  if (count_ > (left + 1) / least)
    throw InputError(path_, fmt::format("element {}", found->name),
                     fmt::format("at most {}, as {} bytes follow the header", (left + 1) / least, left),
                     fmt::format("{}", count_), "the file is cut off");
  addSplatChannels();
}

void PlyReader::addSplatChannels() {
  for (const char* name : {"scale_0", "scale_1", "scale_2", "opacity", "f_dc_0", "f_dc_1", "f_dc_2"})
    if (!channel(name)) return;
  for (const char* name : {"Radius", "Density", "Color"})
    if (channel(name)) return;
  channels_.push_back({"Radius", NumberType::F32, 1});
  channels_.push_back({"Density", NumberType::F32, 1});
  channels_.push_back({"Color", NumberType::F32, 3});
}

void PlyReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelRequest> stored;
  std::vector<const ChannelRequest*> derived;
  for (const ChannelRequest& request : requests) {
    const ChannelSink checked(path_, channels_, request);
    if (checked.index() < placed_.size())
      stored.push_back(request);
    else
      derived.push_back(&request);
  }
  if (derived.empty()) return readStored(stored);
  std::vector<float> scale[3], opacity, harmonic[3];
  for (int k = 0; k < 3; ++k) {
    stored.push_back({fmt::format("scale_{}", k), &scale[k]});
    stored.push_back({fmt::format("f_dc_{}", k), &harmonic[k]});
  }
  stored.push_back({"opacity", &opacity});
  readStored(stored);
  std::vector<float> radius(count_), density(count_);
  std::vector<vec3> color(count_);
  parallelBlocks(count_, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double size = std::exp((double(scale[0][i]) + scale[1][i] + scale[2][i]) / 3), r = std::sqrt(8.0) * size;
      // −ln(1 − α) = ln(1 + e^o)
      const double o = opacity[i], depth = o > 30 ? o : std::log1p(std::exp(o));
      radius[i] = static_cast<float>(r);
      density[i] = static_cast<float>(depth * std::numbers::pi * r * r / 3);
      for (int k = 0; k < 3; ++k)
        color[i][k] = static_cast<float>(std::max(0.0, 0.5 + double(harmonic[k][i]) * 0.5 * std::numbers::inv_sqrtpi));
    }
  });
  for (const ChannelRequest* request : derived) {
    ChannelSink sink(path_, channels_, *request);
    sink.reserve(count_);
    if (request->channel == "Color")
      sink.append(reinterpret_cast<const std::byte*>(color.data()), sizeof(vec3), color.size());
    else
      sink.append(reinterpret_cast<const std::byte*>((request->channel == "Radius" ? radius : density).data()),
                  sizeof(float), radius.size());
  }
}

void PlyReader::readStored(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  try {
    for (ChannelSink& sink : sinks) sink.reserve(count_);
    if (encoding_ == Encoding::Text)
      readText(sinks);
    else
      readBinary(sinks);
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles of {} bytes", path_, count_, rowBytes_));
  }
}

void PlyReader::readBinary(std::vector<ChannelSink>& sinks) const {
  const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / rowBytes_);
  std::vector<std::byte> rows(perBlock * rowBytes_);
  file_.seek(dataBegin_);
  for (std::uint64_t first = 0; first < count_; first += perBlock) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count_ - first));
    if (file_.read(rows.data(), here * rowBytes_) != here * rowBytes_)
      throw InputError(path_, "particle data", fmt::format("{} particles of {} bytes", count_, rowBytes_),
                       fmt::format("the file's end, behind particle {}", first), "it became shorter while it was read");
    for (ChannelSink& sink : sinks)
      sink.append(rows.data() + placed_[sink.index()].offset, rowBytes_, here, encoding_ == Encoding::BigEndian);
  }
}

void PlyReader::readText(std::vector<ChannelSink>& sinks) const {
  constexpr std::size_t kMostDigits = 64;
  const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / rowBytes_);
  std::vector<std::byte> rows(perBlock * rowBytes_);
  ByteStream bytes(file_, dataBegin_);
  for (std::uint64_t first = 0; first < count_; first += perBlock) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count_ - first));
    for (std::size_t i = 0; i < here; ++i)
      for (const PlacedChannel& column : columns_) {
        const std::string word = bytes.word(kMostDigits);
        if (!storeNumberIn(word, column.channel.type, &rows[i * rowBytes_ + column.offset]))
          throw InputError(path_, fmt::format("particle {} of {}, {}", first + i, count_, column.channel.name),
                           "a number", word.empty() ? "the file's end" : "'" + word + "'",
                           word.empty() ? "the file is cut off" : "");
      }
    for (ChannelSink& sink : sinks) sink.append(rows.data() + placed_[sink.index()].offset, rowBytes_, here);
  }
}

}  // namespace mote
