#include "host/particles/formats/bgeo_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "host/core/error.h"
#include "host/particles/formats/channel_sink.h"

namespace mote {
namespace {

constexpr char kMagic[] = {'B', 'g', 'e', 'o', 'V'};
constexpr std::int32_t kVersion = 5;
constexpr std::size_t kMostAttributes = kMostChannels, kMostRowBytes = 1 << 20, kMostTexts = 1 << 20;
constexpr std::size_t kBlockBytes = 1 << 19;
constexpr std::size_t kPlaceBytes = 16;

/// Attribute types, as the file numbers them.
enum : std::int32_t { kFloat = 0, kInteger = 1, kText = 4, kVector = 5 };

/// What stands in front of the points.
class Header {
 public:
  explicit Header(const GzipFile& file) : file_(file) {}

  std::string bytes(std::size_t count, const char* what) {
    std::string data(count, '\0');
    if (file_.read(reinterpret_cast<std::byte*>(data.data()), count) != count)
      throw InputError(file_.path(), what, fmt::format("{} bytes at byte {}", count, at_), "the file's end",
                       "the file is cut off");
    at_ += count;
    return data;
  }
  template <class T>
  T number(const char* what) {
    std::string raw = bytes(sizeof(T), what);
    std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  std::string text(const char* what) {
    const auto size = number<std::uint16_t>(what);
    return bytes(size, what);
  }
  std::uint64_t position() const { return at_; }

 private:
  const GzipFile& file_;
  std::uint64_t at_ = 0;
};

}  // namespace

bool beginsAsBgeo(std::span<const std::byte> start) {
  return start.size() >= sizeof kMagic && std::memcmp(start.data(), kMagic, sizeof kMagic) == 0;
}

BgeoReader::BgeoReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  Header header(file_);
  if (std::memcmp(header.bytes(sizeof kMagic, "BGEO magic number").data(), kMagic, sizeof kMagic) != 0)
    throw InputError(path_, "BGEO magic number", "BgeoV", "something else");
  if (const auto version = header.number<std::int32_t>("BGEO version"); version != kVersion)
    throw InputError(path_, "BGEO version", fmt::format("{}", kVersion), fmt::format("{}", version));
  const auto points = header.number<std::int32_t>("number of points");
  for (const char* what : {"number of primitives", "number of point groups", "number of primitive groups"})
    header.number<std::int32_t>(what);
  const auto attributes = header.number<std::int32_t>("number of point attributes");
  for (const char* what : {"number of vertex attributes", "number of primitive attributes", "number of attributes"})
    header.number<std::int32_t>(what);
  if (points < 0) throw InputError(path_, "number of points", "0 or more", fmt::format("{}", points));
  if (attributes < 0 || static_cast<std::size_t>(attributes) > kMostAttributes)
    throw InputError(path_, "number of point attributes", fmt::format("0 to {}", kMostAttributes),
                     fmt::format("{}", attributes));
  const auto add = [&](std::string name, NumberType type, std::uint32_t arity, std::size_t offset) {
    if (channel(name)) throw InputError(path_, "point attributes", "different names", fmt::format("'{}' twice", name));
    placed_.emplace_back(std::move(name), type, arity, offset);
    channels_.push_back(placed_.back().channel);
  };
  add("Position", NumberType::F32, 3, 0);
  rowBytes_ = kPlaceBytes;
  for (std::int32_t k = 0; k < attributes; ++k) {
    std::string name = header.text("an attribute's name");
    const auto size = header.number<std::uint16_t>("an attribute's size");
    const auto type = header.number<std::int32_t>("an attribute's type");
    const std::string what = fmt::format("point attribute {} ('{}')", k, name.substr(0, 40));
    const std::size_t bytes = std::size_t{size} * 4;
    if (size == 0 || bytes > kMostRowBytes - rowBytes_)
      throw InputError(path_, what, fmt::format("1 number or more, {} bytes a point at most", kMostRowBytes),
                       fmt::format("{} numbers", size));
    if (type == kText) {
      const auto texts = header.number<std::int32_t>("an attribute's texts");
      if (texts < 0 || static_cast<std::size_t>(texts) > kMostTexts)
        throw InputError(path_, what, fmt::format("0 to {} texts", kMostTexts), fmt::format("{}", texts));
      for (std::int32_t t = 0; t < texts; ++t) header.text("a text of an attribute");
    } else if (type == kFloat || type == kVector || type == kInteger) {
      header.bytes(bytes, "an attribute's default");
      add(std::move(name), type == kInteger ? NumberType::I32 : NumberType::F32, size, rowBytes_);
    } else {
      throw InputError(path_, what, "a type of 0, 1, 4 or 5 (float, integer, text, vector)", fmt::format("{}", type));
    }
    rowBytes_ += bytes;
  }
  dataBegin_ = header.position();
  format_ = file_.packed() ? "BGEO 5 (gzip)" : "BGEO 5";
  count_ = static_cast<std::uint64_t>(points);
  const std::uint64_t most = file_.mostBytes();
  if (count_ > (most > dataBegin_ ? most - dataBegin_ : 0) / rowBytes_)
    throw InputError(path_, "number of points", fmt::format("what {} bytes can hold", file_.bytes()),
                     fmt::format("{} of {} bytes", count_, rowBytes_), "the file is cut off or damaged");
}

void BgeoReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / rowBytes_);
  std::vector<std::byte> rows(perBlock * rowBytes_);
  try {
    for (ChannelSink& sink : sinks) sink.reserve(std::min(count_, file_.bytes()));
    file_.seek(dataBegin_);
    for (std::uint64_t first = 0; first < count_; first += perBlock) {
      const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count_ - first));
      const std::size_t got = file_.read(rows.data(), here * rowBytes_);
      if (got != here * rowBytes_)
        throw InputError(path_, "point data", fmt::format("{} points of {} bytes", count_, rowBytes_),
                         fmt::format("the file's end at point {}", first + got / rowBytes_), "the file is cut off");
      for (ChannelSink& sink : sinks) sink.append(rows.data() + placed_[sink.index()].offset, rowBytes_, here, true);
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} points of {} bytes", path_, count_, rowBytes_));
  }
}

}  // namespace mote
