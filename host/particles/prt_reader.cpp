#include "host/particles/prt_reader.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <tbb/parallel_pipeline.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <new>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/prt_header.h"
#include "host/particles/prt_visit.h"

namespace mote {
namespace {

// Deflate's best case: 258 bytes from one length and one distance code of a bit each, less block headers (zlib.net,
// "Maximum Compression Factor").
constexpr std::uint64_t kMaxExpansion = 1032;
// Large enough to hide a task's start, small enough that the blocks in flight stay in the cache.
constexpr std::size_t kBlockBytes = 1 << 19;
constexpr std::size_t kInputBytes = 1 << 17;
// Memory that is reserved at once: what the file's bytes give at this ratio (particles compress 1 to 4 times). Files
// that expand further grow their arrays as the data arrive.
constexpr std::uint64_t kReservedExpansion = 8;

template <class To, class From>
To converted(From value) {
  if constexpr (std::is_same_v<To, std::uint64_t> && !std::is_integral_v<From>) {
    const double number = static_cast<double>(value);
    return number >= 0 && number < 0x1p64 ? static_cast<std::uint64_t>(number) : 0;
  } else {
    return static_cast<To>(value);
  }
}

/// Copies `components` numbers of each of `count` particles; source numbers may stand unaligned.
template <class From, class To>
void convertColumn(const std::byte* from, std::size_t stride, std::size_t count, int components, bool broadcast,
                   To* to) {
  for (std::size_t i = 0; i < count; ++i, from += stride)
    for (int c = 0; c < components; ++c) {
      From value;
      std::memcpy(&value, from + (broadcast ? 0 : c * sizeof(From)), sizeof value);
      *to++ = converted<To>(value);
    }
}

template <class To>
void convertTyped(PrtType type, const std::byte* from, std::size_t stride, std::size_t count, int components,
                  bool broadcast, To* to) {
  withPrtType(type, [&]<class From>(From) { convertColumn<From>(from, stride, count, components, broadcast, to); });
}

/// One request, resolved against the header.
class Column {
 public:
  Column(const PrtReader& reader, const PrtRequest& request) : target_(request.target) {
    const PrtChannel* channel = reader.header().channel(request.channel);
    if (!channel)
      throw InputError(reader.path(), "", fmt::format("a channel '{}'", request.channel), "none of that name",
                       "it has " + reader.header().describeChannels());
    channel_ = *channel;
    const bool isVector = std::holds_alternative<std::vector<vec3>*>(target_);
    const bool isRaw = std::holds_alternative<std::vector<std::byte>*>(target_);
    const bool fits = isRaw || channel_.arity == 1 || (isVector && channel_.arity >= 3);
    if (!fits)
      throw InputError(reader.path(), fmt::format("channel '{}'", request.channel),
                       isVector ? "arity 3 (or 1, or more)" : "arity 1", fmt::format("arity {}", channel_.arity));
    perParticle_ = isRaw ? channel_.bytes() : 1;
  }

  void reserve(std::uint64_t particles) {
    std::visit([&](auto* to) { to->clear(), to->reserve(particles * perParticle_); }, target_);
  }

  void append(const std::byte* block, std::size_t stride, std::size_t count) {
    const std::byte* from = block + channel_.offset;
    std::visit([&](auto* to) { appendTo(*to, from, stride, count); }, target_);
  }

 private:
  void appendTo(std::vector<std::byte>& to, const std::byte* from, std::size_t stride, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i, from += stride) to.insert(to.end(), from, from + perParticle_);
  }
  void appendTo(std::vector<vec3>& to, const std::byte* from, std::size_t stride, std::size_t count) {
    const std::size_t old = to.size();
    to.resize(old + count);
    static_assert(sizeof(vec3) == 3 * sizeof(float));
    if (count > 0) convertTyped(channel_.type, from, stride, count, 3, channel_.arity == 1, &to[old].x);
  }
  template <class T>
  void appendTo(std::vector<T>& to, const std::byte* from, std::size_t stride, std::size_t count) {
    const std::size_t old = to.size();
    to.resize(old + count);
    if (count > 0) convertTyped(channel_.type, from, stride, count, 1, false, &to[old]);
  }

  std::variant<std::vector<float>*, std::vector<vec3>*, std::vector<std::uint64_t>*, std::vector<std::byte>*> target_;
  PrtChannel channel_;
  std::size_t perParticle_ = 1;
};

/// The file's zlib stream as a source of bytes.
class Inflater {
 public:
  Inflater(const std::string& path, std::FILE* file) : path_(path), file_(file), input_(kInputBytes) {
    if (inflateInit(&stream_) != Z_OK) throw MachineError(fmt::format("{}: zlib cannot start: {}", path_, why()));
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  bool ended() const { return ended_; }
  bool starved() const { return starved_; }  ///< the file ended before the stream did
  std::uint64_t bytesIn() const { return bytesRead_ - stream_.avail_in; }

  /// Fills `out` as far as the data go; less than asked for only once ended() or starved().
  std::size_t fill(std::byte* out, std::size_t wanted) {
    stream_.next_out = reinterpret_cast<Bytef*>(out);
    stream_.avail_out = static_cast<uInt>(wanted);
    while (stream_.avail_out > 0 && !ended_ && !starved_) {
      if (stream_.avail_in == 0 && !refill()) break;
      step();
    }
    return wanted - stream_.avail_out;
  }

  /// After the last particle: reads on to the stream's checksum. True if more data come first.
  bool hasMore() {
    std::byte extra;
    return fill(&extra, 1) > 0;
  }

 private:
  const char* why() const { return stream_.msg ? stream_.msg : "no reason given"; }

  bool refill() {
    const std::size_t got = std::fread(input_.data(), 1, input_.size(), file_);
    if (got == 0 && std::ferror(file_))
      throw MachineError(fmt::format("{}: reading failed after {} bytes of particle data: {}", path_, bytesRead_,
                                     std::strerror(errno)));
    bytesRead_ += got;
    stream_.next_in = input_.data();
    stream_.avail_in = static_cast<uInt>(got);
    starved_ = got == 0;
    return got > 0;
  }

  void step() {
    const int status = inflate(&stream_, Z_NO_FLUSH);
    if (status == Z_STREAM_END) {
      ended_ = true;
    } else if (status == Z_MEM_ERROR) {
      throw MachineError(fmt::format("{}: zlib is out of memory", path_));
    } else if (status != Z_OK && status != Z_BUF_ERROR) {
      const std::string message = status == Z_NEED_DICT ? "it asks for a preset dictionary" : why();
      throw InputError(path_, "particle data", "a valid zlib stream",
                       fmt::format("'{}' about {} bytes into it", message, bytesIn()), "the file is damaged");
    }
  }

  const std::string& path_;
  std::FILE* file_;
  std::vector<Bytef> input_;
  z_stream stream_{};
  std::uint64_t bytesRead_ = 0;
  bool ended_ = false, starved_ = false;
};

struct Block {
  std::vector<std::byte> bytes;
  std::size_t particles = 0;
};

[[noreturn]] void throwTruncated(const PrtReader& reader, const Inflater& stream, std::uint64_t bytesOut) {
  const PrtHeader& header = reader.header();
  const std::string got = stream.ended() ? "the zlib stream ends" : "the file ends";
  throw InputError(
      reader.path(), "particle data", fmt::format("{} particles of {} bytes", header.count, header.particleBytes),
      fmt::format("{} at particle {} of {}, after {} of {} bytes ({} compressed)", got, bytesOut / header.particleBytes,
                  header.count, bytesOut, header.count * header.particleBytes, stream.bytesIn()),
      "the file is cut off, or its header promises too many");
}

}  // namespace

PrtReader::PrtReader(std::string path) : path_(std::move(path)) {
  struct stat facts {};
  if (::stat(path_.c_str(), &facts) != 0) throw InputError(path_, "", "a readable file", std::strerror(errno));
  if (!S_ISREG(facts.st_mode))
    throw InputError(path_, "", "a file", S_ISDIR(facts.st_mode) ? "a folder" : "a device or pipe");
  file_.reset(std::fopen(path_.c_str(), "rbe"));
  if (!file_) throw InputError(path_, "", "a readable file", std::strerror(errno));
  fileBytes_ = static_cast<std::uint64_t>(facts.st_size);

  ParsedPrtHeader parsed = parsePrtHeader(path_, file_.get(), fileBytes_);
  header_ = std::move(parsed.header);
  dataBegin_ = parsed.dataBegin;
  const std::uint64_t left = fileBytes_ - dataBegin_;
  // particleBytes ≥ 1, and left × 1032 stays far below 2^64 for any file that exists; the division cannot overflow.
  if (header_.count > left * kMaxExpansion / header_.particleBytes)
    throw InputError(
        path_, "particle count",
        fmt::format("at most {}, what {} bytes of zlib data can hold ({} bytes a particle, expansion at most {})",
                    left * kMaxExpansion / header_.particleBytes, left, header_.particleBytes, kMaxExpansion),
        fmt::format("{}", header_.count), "the file is cut off or its header is damaged");
}

void PrtReader::read(std::span<const PrtRequest> requests) const {
  std::vector<Column> columns;
  for (const PrtRequest& request : requests) columns.emplace_back(*this, request);
  if (fseeko(file_.get(), static_cast<off_t>(dataBegin_), SEEK_SET) != 0)
    throw MachineError(fmt::format("{}: seeking to byte {} failed", path_, dataBegin_));
  const std::uint64_t left = fileBytes_ - dataBegin_, count = header_.count;
  const std::size_t size = header_.particleBytes;
  const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / size);
  try {
    for (Column& column : columns) column.reserve(std::min(count, left * kReservedExpansion / size));
    if (count == 0 && left == 0) return;

    // Two stages at once: one task decompresses a block while another converts the one before.
    constexpr std::size_t kBlocksInFlight = 4;
    Inflater stream(path_, file_.get());
    std::vector<Block> ring(kBlocksInFlight);
    std::uint64_t begun = 0, turn = 0;
    const auto decompress = [&](tbb::flow_control& flow) -> Block* {
      if (begun == count) return flow.stop(), nullptr;
      Block& block = ring[turn++ % kBlocksInFlight];
      block.particles = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count - begun));
      block.bytes.resize(perBlock * size);
      const std::size_t got = stream.fill(block.bytes.data(), block.particles * size);
      if (got < block.particles * size) throwTruncated(*this, stream, begun * size + got);
      begun += block.particles;
      return &block;
    };
    const auto convert = [&](Block* block) {
      for (Column& column : columns) column.append(block->bytes.data(), size, block->particles);
    };
    using tbb::filter_mode;
    tbb::parallel_pipeline(kBlocksInFlight, tbb::make_filter<void, Block*>(filter_mode::serial_in_order, decompress) &
                                                tbb::make_filter<Block*, void>(filter_mode::serial_in_order, convert));

    if (stream.hasMore() || (stream.ended() && dataBegin_ + stream.bytesIn() < fileBytes_))
      logWarning(fmt::format("{}: ignored data behind the last of its {} particles", path_, count));
    else if (!stream.ended())
      throw InputError(path_, "particle data", "a zlib stream with its checksum",
                       fmt::format("the file's end, after particle {} of {} and {} compressed bytes", count, count,
                                   stream.bytesIn()),
                       "the file is cut off");
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles of {} bytes", path_, count, size));
  }
}

}  // namespace mote
