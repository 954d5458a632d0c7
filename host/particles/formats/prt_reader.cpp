#include "host/particles/formats/prt_reader.h"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <new>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/prt_header.h"

namespace mote {
namespace {

// Large enough to hide a task's start, small enough that the blocks in flight stay in the cache.
constexpr std::size_t kBlockBytes = 1 << 19;
constexpr std::size_t kInputBytes = 1 << 17;
// Memory that is reserved at once: what the file's bytes give at this ratio (particles compress 1 to 4 times). Files
// that expand further grow their arrays as the data arrive.
constexpr std::uint64_t kReservedExpansion = 8;

/// A sink, and where its channel stands in a packed particle.
struct Column {
  ChannelSink sink;
  std::size_t offset;
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

bool beginsAsPrt(std::span<const std::byte> start) {
  constexpr std::size_t kName = 4;  // also of damaged ones
  return start.size() > kName && std::memcmp(start.data(), kPrtMagic, kName) == 0 && start[kName] != std::byte{'2'};
}

PrtReader::PrtReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  ParsedPrtHeader parsed = parsePrtHeader(file_);
  header_ = std::move(parsed.header);
  dataBegin_ = parsed.dataBegin;
  format_ = fmt::format("PRT 1.{}", header_.minorVersion);
  count_ = header_.count;
  channels_.assign(header_.channels.begin(), header_.channels.end());
  metadata_ = header_.metadata;
  const std::uint64_t left = file_.bytes() - dataBegin_;
  // particleBytes ≥ 1, and left × 1032 stays far below 2^64 for any file that exists; the division cannot overflow.
  if (header_.count > left * kDeflateExpansion / header_.particleBytes)
    throw InputError(
        path_, "particle count",
        fmt::format("at most {}, what {} bytes of zlib data can hold ({} bytes a particle, expansion at most {})",
                    left * kDeflateExpansion / header_.particleBytes, left, header_.particleBytes, kDeflateExpansion),
        fmt::format("{}", header_.count), "the file is cut off or its header is damaged");
}

void PrtReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<Column> columns;
  for (const ChannelRequest& request : requests) {
    ChannelSink sink(path_, channels_, request);
    columns.push_back({sink, header_.channels[sink.index()].offset});
  }
  file_.seek(dataBegin_);
  const std::uint64_t left = file_.bytes() - dataBegin_, count = header_.count;
  const std::size_t size = header_.particleBytes;
  const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / size);
  try {
    for (Column& column : columns) column.sink.reserve(std::min(count, left * kReservedExpansion / size));
    if (count == 0 && left == 0) return;

    // Two stages at once: one task decompresses a block while another converts the one before.
    constexpr std::size_t kBlocksInFlight = 4;
    Inflater stream(path_, file_.handle());
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
      for (Column& column : columns) column.sink.append(block->bytes.data() + column.offset, size, block->particles);
    };
    using tbb::filter_mode;
    tbb::parallel_pipeline(kBlocksInFlight, tbb::make_filter<void, Block*>(filter_mode::serial_in_order, decompress) &
                                                tbb::make_filter<Block*, void>(filter_mode::serial_in_order, convert));

    if (stream.hasMore() || (stream.ended() && dataBegin_ + stream.bytesIn() < file_.bytes()))
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
