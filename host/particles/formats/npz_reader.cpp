#include "host/particles/formats/npz_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <optional>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/our_channels.h"

namespace mote {
namespace {

constexpr char kZipMagic[] = {'P', 'K', 3, 4};
constexpr std::size_t kZipName = 30;  ///< where the first member's name begins; its length stands at byte 26
constexpr std::string_view kEnding = ".npy";
constexpr std::uint64_t kMostMetadataNumbers = 16;
constexpr std::size_t kMostText = 4096;

/// The names that numpy.savez gives arrays without one begin so.
constexpr std::string_view kFirstUnnamed = "arr_0";

bool isColumns(const NpyArray& array) {
  return !array.structured && array.notNumbers.empty() && !array.fields.empty() && !array.shape.empty();
}
bool isPoints(const NpyArray& array) { return isColumns(array) && array.shape.size() == 2 && array.shape[1] >= 3; }

/// Numbers of a short array, in C's order; none: they are too many for metadata, or in another order.
std::optional<std::uint64_t> fewNumbers(const NpyArray& array) {
  std::uint64_t all = 1;
  for (const std::uint64_t n : array.shape) {
    if (n > kMostMetadataNumbers) return std::nullopt;
    all *= n;
    if (all > kMostMetadataNumbers) return std::nullopt;
  }
  return array.fortranOrder && array.shape.size() > 1 ? std::nullopt : std::optional(all);
}

/// "8 × 3", "a scalar".
std::string shapeText(const NpyArray& array) {
  std::string text;
  for (const std::uint64_t n : array.shape) text += fmt::format("{}{}", text.empty() ? "" : " × ", n);
  return text.empty() ? "a scalar" : text;
}

/// UTF-32, of which NumPy's texts are, as UTF-8; ends at the first zero.
std::string utf8(const std::string& raw, bool bigEndian) {
  std::string text;
  for (std::size_t k = 0; k + 4 <= raw.size(); k += 4) {
    std::uint32_t c = 0;
    for (std::size_t b = 0; b < 4; ++b)
      c |= std::uint32_t{static_cast<unsigned char>(raw[k + b])} << (8 * (bigEndian ? 3 - b : b));
    if (c == 0) break;
    if (c > 0x10ffff) return "";
    const auto tail = [&](int shift) { text += static_cast<char>(0x80 | ((c >> shift) & 0x3f)); };
    if (c < 0x80)
      text += static_cast<char>(c);
    else if (c < 0x800)
      text += static_cast<char>(0xc0 | c >> 6), tail(0);
    else if (c < 0x10000)
      text += static_cast<char>(0xe0 | c >> 12), tail(6), tail(0);
    else
      text += static_cast<char>(0xf0 | c >> 18), tail(12), tail(6), tail(0);
  }
  return text;
}

/// Bytes of one text of type "<U5" or "|S5", and bytes of one of its letters; none: it is another type.
struct TextType {
  std::size_t bytes = 0, letter = 1;
  bool bigEndian = false;
};
std::optional<TextType> textType(const std::string& type) {
  const std::size_t kind = type.find_first_of("US");
  if (kind > 1 || type.size() > kind + 5 || type.size() < kind + 2) return std::nullopt;
  TextType text{0, type[kind] == 'U' ? 4u : 1u, type[0] == '>'};
  for (std::size_t k = kind + 1; k < type.size(); ++k) {
    if (type[k] < '0' || type[k] > '9') return std::nullopt;
    text.bytes = text.bytes * 10 + static_cast<std::size_t>(type[k] - '0');
  }
  text.bytes *= text.letter;
  return text.bytes <= kMostText ? std::optional(text) : std::nullopt;
}

void swapBytes(std::byte* numbers, std::size_t size, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) std::reverse(numbers + i * size, numbers + (i + 1) * size);
}

}  // namespace

bool beginsAsNpz(std::span<const std::byte> start) {
  if (start.size() < kZipName || std::memcmp(start.data(), kZipMagic, sizeof kZipMagic) != 0) return false;
  const std::size_t length = std::to_integer<std::size_t>(start[26]) | std::to_integer<std::size_t>(start[27]) << 8;
  if (length > start.size() - kZipName) return false;
  return std::string_view(reinterpret_cast<const char*>(start.data()) + kZipName, length).ends_with(kEnding);
}

NpzReader::NpzReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  format_ = "NPZ";
  openArrays();
  takeTables();
  setChannels();
  if (!leftOut_.empty()) logWarning(fmt::format("{}: left out {}", path_, leftOut_));
}

void NpzReader::leaveOut(const Array& array, const std::string& reason) {
  leftOut_ += fmt::format("{}'{}' ({})", leftOut_.empty() ? "" : ", ", array.name, reason);
}

void NpzReader::openArrays() {
  for (std::size_t k = 0; k < file_.members().size(); ++k) {
    const ZipMember& member = file_.members()[k];
    Array array;
    array.member = k, array.name = member.name;
    if (!member.name.ends_with(kEnding)) {
      leaveOut(array, "no array: its name does not end in .npy");
      continue;
    }
    array.name.resize(array.name.size() - kEnding.size());
    const std::string place = fmt::format("{}: '{}'", path_, member.name);
    ZipStream stream(file_, member);
    const auto bytes = [&](std::uint64_t count, std::string_view what) {
      std::string data(count, '\0');  // at most as long as a header may be
      stream.readAll(reinterpret_cast<std::byte*>(data.data()), count, std::string(what).c_str());
      return data;
    };
    array.header = readNpyHeader(place, bytes, member.bytes);
    keepMetadata(stream, array);
    arrays_.push_back(std::move(array));
  }
}

/// A scalar, or a short row of numbers; what turns out to be a channel is taken back later.
void NpzReader::keepMetadata(ZipStream& stream, const Array& array) {
  const NpyArray& header = array.header;
  const std::optional<std::uint64_t> numbers = fewNumbers(header);
  std::optional<TextType> text;
  std::size_t bytes = 0;
  if (!header.notNumbers.empty()) {
    text = textType(header.notNumbers);
    if (!text || header.structured || !header.shape.empty() || meta("", array.name)) return;
    bytes = text->bytes;
  } else {
    if (header.structured || header.fields.empty() || !numbers || meta("", array.name)) return;
    bytes = *numbers * header.elementBytes;
  }
  std::string raw(bytes, '\0');
  stream.readAll(reinterpret_cast<std::byte*>(raw.data()), bytes, "data");
  if (text) {
    const std::string plain = text->letter == 4 ? utf8(raw, text->bigEndian) : raw.substr(0, raw.find('\0'));
    metadata_.push_back(Metadata::text("", array.name, plain));
    return;
  }
  const NumberType type = header.fields[0].channel.type;
  if (header.bigEndian) swapBytes(reinterpret_cast<std::byte*>(raw.data()), numberSize(type), *numbers);
  metadata_.push_back({"", array.name, static_cast<std::int32_t>(type), std::move(raw)});
}

const NpzReader::Array& NpzReader::positions() const {
  const auto first = [&](const auto& is) -> const Array* {
    const auto found = std::find_if(arrays_.begin(), arrays_.end(), is);
    return found == arrays_.end() ? nullptr : &*found;
  };
  const std::vector<std::string_view> names = namesInFiles("Position");
  for (const std::string_view name : names) {
    if (const Array* array = first([&](const Array& a) { return a.name == name && isPoints(a.header); })) return *array;
    const auto hasField = [&](const Array& a) {
      if (!a.header.structured || a.header.shape.size() != 1) return false;
      const std::vector<PlacedChannel> channels = withVectors(a.header.fields);
      return std::any_of(channels.begin(), channels.end(),
                         [&](const PlacedChannel& c) { return c.channel.name == name; });
    };
    if (const Array* array = first(hasField)) return *array;
  }
  for (const char* x : {"x", "X", "px"})
    if (const Array* array = first([&](const Array& a) { return a.name == x && isColumns(a.header); })) return *array;
  if (const Array* array = first([](const Array& a) { return isPoints(a.header); })) return *array;
  if (const Array* array = first([](const Array& a) { return a.header.structured && a.header.shape.size() == 1; }))
    return *array;
  refusePositions();
}

void NpzReader::refusePositions() const {
  std::string has;
  for (const Array& a : arrays_)
    has += fmt::format("{}'{}' ({}{})", has.empty() ? "" : ", ", a.name, shapeText(a.header),
                       a.header.notNumbers.empty() ? "" : fmt::format(", type '{}'", a.header.notNumbers));
  throw InputError(path_, "", "an array of positions, N × 3, named Position or P, or arrays x, y and z",
                   has.empty() ? "no arrays" : has, "Python objects, texts and complex numbers are no particles");
}

void NpzReader::takeTables() {
  const NpyArray& leader = positions().header;
  count_ = leader.shape[0];
  const auto unnamed = [](const Array& a) { return isPoints(a.header) && a.name == kFirstUnnamed; };
  const bool onlyOne = arrays_.size() == 1 && unnamed(arrays_[0]);
  for (Array& array : arrays_) {
    const NpyArray& header = array.header;
    const std::string place = fmt::format("{}: '{}.npy'", path_, array.name);
    const bool kept = meta("", array.name) != nullptr;
    if (!header.notNumbers.empty()) {
      if (!kept)
        leaveOut(array, header.notNumbers.find('O') != std::string::npos
                            ? "Python objects (pickle), which could run any program; save numbers"
                            : fmt::format("type '{}'", header.notNumbers));
    } else if (header.shape.empty() || header.shape[0] != count_ || header.fields.empty()) {
      if (!kept) leaveOut(array, fmt::format("{}, where the particles are {}", shapeText(header), count_));
    } else if (!header.structured && header.fortranOrder && header.shape.size() > 2) {
      leaveOut(array, fmt::format("{} in Fortran's order", shapeText(header)));
    } else if (header.structured && header.shape.size() > 1) {
      leaveOut(array, fmt::format("{} with fields", shapeText(header)));
    } else if (!header.structured && numbersOfRow(place, header) == 0) {
      leaveOut(array, shapeText(header));
    } else if (header.structured || onlyOne) {
      array.table = npyTable(place, header);
    } else {
      const std::uint64_t arity = numbersOfRow(place, header);
      array.table = {count_, header.elementBytes * arity, {}, header.bigEndian, header.fortranOrder && arity > 1};
      array.table.channels.emplace_back(array.name, header.fields[0].channel.type, static_cast<std::uint32_t>(arity),
                                        0);
    }
  }
  if (std::all_of(arrays_.begin(), arrays_.end(), [](const Array& a) { return a.table.channels.empty(); }))
    refusePositions();
  std::erase_if(metadata_, [&](const Metadata& m) {
    return std::any_of(arrays_.begin(), arrays_.end(),
                       [&](const Array& a) { return a.name == m.name && !a.table.channels.empty(); });
  });
  std::erase_if(arrays_, [](const Array& a) { return a.table.channels.empty(); });
}

void NpzReader::setChannels() {
  std::vector<PlacedChannel> columns;
  std::size_t begin = 0;
  for (Array& array : arrays_) {
    const std::uint64_t left = file_.members()[array.member].bytes - array.header.dataBegin;
    if (count_ > left / array.table.rowBytes || count_ * array.table.rowBytes != left)
      throw InputError(fmt::format("{}: '{}.npy'", path_, array.name), "shape",
                       fmt::format("what {} bytes hold, rows of {} bytes", left, array.table.rowBytes),
                       fmt::format("{} rows", count_), "the file is cut off or damaged");
    array.virtualBegin = begin;
    for (PlacedChannel column : array.table.channels) {
      column.offset += begin;
      columns.push_back(std::move(column));
    }
    begin += array.table.rowBytes;
  }
  requireFewChannels(path_, columns.size());
  const bool joined = std::none_of(arrays_.begin(), arrays_.end(), [](const Array& a) { return a.header.structured; });
  for (const PlacedChannel& placed : joined ? withVectors(columns) : columns) {
    const Channel& channel = placed.channel;
    if (this->channel(channel.name))
      throw InputError(path_, "arrays", "channels of different names", fmt::format("'{}' twice", channel.name));
    const auto next =
        std::find_if(arrays_.begin(), arrays_.end(), [&](const Array& a) { return a.virtualBegin > placed.offset; });
    const auto array = static_cast<std::size_t>(next - arrays_.begin()) - 1;
    const std::size_t offset = placed.offset - arrays_[array].virtualBegin;
    const bool inOne = channel.bytes() <= arrays_[array].table.rowBytes - offset;
    places_.push_back({array, inOne ? 1u : channel.arity, offset});
    channels_.push_back(channel);
  }
}

void NpzReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  try {
    for (ChannelSink& sink : sinks) sink.reserve(std::min(count_, file_.bytes()));
    // Each array once, whatever number of channels is taken from it.
    for (std::size_t array = 0; array < arrays_.size(); ++array) {
      std::vector<ChannelSink*> here;
      Place place;
      for (ChannelSink& sink : sinks)
        if (places_[sink.index()].array == array) here.push_back(&sink), place = places_[sink.index()];
      if (!here.empty()) readPlace(place, here);
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles", path_, count_));
  }
}

/// One or three arrays side by side, in blocks.
void NpzReader::readPlace(const Place& place, std::vector<ChannelSink*>& sinks) const {
  struct Part {
    const NpyTable& table;
    ZipStream stream;
    std::vector<std::byte> whole;  ///< of an array by columns, which cannot be read in order
    std::optional<NpyRows> rows;
  };
  std::vector<std::unique_ptr<Part>> parts;
  for (std::size_t k = 0; k < place.arrays; ++k) {
    const Array& array = arrays_[place.array + k];
    parts.emplace_back(new Part{array.table, ZipStream(file_, file_.members()[array.member]), {}, std::nullopt});
    Part& part = *parts.back();
    std::vector<std::byte> header(array.header.dataBegin);
    part.stream.readAll(header.data(), header.size(), "header");
    constexpr std::size_t kPiece = 1 << 20;
    for (std::uint64_t left = array.table.byColumns ? count_ * array.table.rowBytes : 0; left > 0;) {
      const std::size_t old = part.whole.size(), piece = std::min<std::uint64_t>(left, kPiece);
      part.whole.resize(old + piece);
      part.stream.readAll(&part.whole[old], piece, "data");
      left -= piece;
    }
    part.rows.emplace(array.table, [&part](std::byte* to, std::uint64_t from, std::size_t bytes) {
      if (part.table.byColumns)
        std::memcpy(to, &part.whole[from], bytes);
      else
        part.stream.readAll(to, bytes, "data");
    });
  }
  const std::size_t perBlock = parts[0]->rows->perBlock(), size = parts[0]->table.rowBytes;
  std::vector<std::byte> together;
  for (std::uint64_t first = 0; first < count_; first += perBlock) {
    const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count_ - first));
    if (parts.size() == 1) {
      const std::byte* block = parts[0]->rows->read(first, here);
      for (ChannelSink* sink : sinks)
        sink->append(block + places_[sink->index()].offset, size, here, parts[0]->table.bigEndian);
      continue;
    }
    together.resize(here * size * parts.size());  // scalars of one size: the vector that they are
    for (std::size_t k = 0; k < parts.size(); ++k) {
      std::byte* block = parts[k]->rows->read(first, here);
      if (parts[k]->table.bigEndian) swapBytes(block, size, here);
      for (std::size_t i = 0; i < here; ++i)
        std::memcpy(&together[(i * parts.size() + k) * size], block + i * size, size);
    }
    for (ChannelSink* sink : sinks) sink->append(together.data(), size * parts.size(), here);
  }
  for (const std::unique_ptr<Part>& part : parts) part->stream.expectEnd();
}

}  // namespace mote
