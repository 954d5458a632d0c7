#include "host/particles/formats/prt_reader.h"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/prt_header.h"
#include "host/particles/formats/prt_inflater.h"

namespace mote {
namespace {

// Large enough to hide a task's start, small enough that the blocks in flight stay in the cache.
constexpr std::size_t kBlockBytes = 1 << 19;
// Memory that is reserved at once: what the file's bytes give at this ratio (particles compress 1 to 4 times). Files
// that expand further grow their arrays as the data arrive.
constexpr std::uint64_t kReservedExpansion = 8;

constexpr std::string_view kChecksum = "incorrect data check";  // as zlib says it

/// A sink, and where its channel stands in a packed particle.
struct Column {
  ChannelSink sink;
  std::size_t offset;
};

struct Block {
  std::vector<std::byte> bytes;
  std::size_t particles = 0;
};

constexpr const char* kRepair = "mote repair IN OUT saves the particles that are there";

[[noreturn]] void throwDamaged(const PrtReader& reader, const PrtInflater& stream) {
  throw InputError(reader.path(), "particle data", "a valid zlib stream",
                   fmt::format("'{}' about {} bytes into it", stream.damage(), stream.bytesIn()),
                   fmt::format("the file is damaged; {}", kRepair));
}

[[noreturn]] void throwTruncated(const PrtReader& reader, const PrtInflater& stream, std::uint64_t bytesOut) {
  const PrtHeader& header = reader.header();
  const std::string got = stream.ended() ? "the zlib stream ends" : "the file ends";
  throw InputError(
      reader.path(), "particle data", fmt::format("{} particles of {} bytes", header.count, header.particleBytes),
      fmt::format("{} at particle {} of {}, after {} of {} bytes ({} compressed)", got, bytesOut / header.particleBytes,
                  header.count, bytesOut, header.count * header.particleBytes, stream.bytesIn()),
      fmt::format("the file is cut off, or its header promises too many; {}", kRepair));
}

}  // namespace

bool beginsAsPrt(std::span<const std::byte> start) {
  constexpr std::size_t kName = 4;  // also of damaged ones
  return start.size() > kName && std::memcmp(start.data(), kPrtMagic, kName) == 0 && start[kName] != std::byte{'2'};
}

PrtReader::PrtReader(std::string path, WhatIsWrong* salvage) : ParticleFile(path), file_(std::move(path)) {
  ParsedPrtHeader parsed = parsePrtHeader(file_, salvage != nullptr);
  header_ = std::move(parsed.header);
  dataBegin_ = parsed.dataBegin;
  format_ = fmt::format("PRT 1.{}", header_.minorVersion);
  channels_.assign(header_.channels.begin(), header_.channels.end());
  metadata_ = header_.metadata;
  if (salvage) {
    countWhole(*salvage, parsed.countKnown);
    return;
  }
  count_ = header_.count;
  const std::uint64_t left = file_.bytes() - dataBegin_;
  // particleBytes ≥ 1, and left × 1032 stays far below 2^64 for any file that exists; the division cannot overflow.
  if (header_.count > left * kDeflateExpansion / header_.particleBytes)
    throw InputError(
        path_, "particle count",
        fmt::format("at most {}, what {} bytes of zlib data can hold ({} bytes a particle, expansion at most {})",
                    left * kDeflateExpansion / header_.particleBytes, left, header_.particleBytes, kDeflateExpansion),
        fmt::format("{}", header_.count), fmt::format("the file is cut off or its header is damaged; {}", kRepair));
}

void PrtReader::countWhole(WhatIsWrong& wrong, bool countKnown) {
  const std::size_t size = header_.particleBytes;
  constexpr std::size_t kAtOnce = 1 << 16;
  std::vector<std::byte> block(kAtOnce);
  file_.seek(dataBegin_);
  PrtInflater stream(file_);
  std::uint64_t bytes = 0;
  while (!stream.ended() && !stream.starved() && !stream.damaged()) bytes += stream.fill(block.data(), block.size());
  count_ = bytes / size;
  if (countKnown) wrong.promised = header_.count;
  if (countKnown && header_.count == 0 && dataBegin_ == file_.bytes()) return;  // no particles, and no stream of them
  const bool bytesLeft = bytes % size != 0, checked = stream.ended();
  if (stream.damaged())
    wrong.sentence = fmt::format("zlib found damage ('{}') about {} bytes into the particle data{}", stream.damage(),
                                 stream.bytesIn(),
                                 stream.damage() == kChecksum ? ": some numbers are not what was written"
                                                              : "; the last particles before it may be wrong, too");
  else if (stream.starved())
    wrong.sentence = bytesLeft ? fmt::format("the file ends within particle {}", count_)
                               : fmt::format("the file ends behind particle {}", count_);
  else if (bytesLeft)
    wrong.sentence = fmt::format("the particle data end within particle {}", count_);
  else if (!countKnown)
    wrong.sentence = "the number of particles was never written; all the data are there";
  else if (header_.count != count_)
    wrong.sentence = fmt::format("the header promises {}", header_.count);
  header_.count = count_;
  partial_ = !checked || bytesLeft;
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
    PrtInflater stream(file_);
    std::vector<Block> ring(kBlocksInFlight);
    std::uint64_t begun = 0, turn = 0;
    const auto decompress = [&](tbb::flow_control& flow) -> Block* {
      if (begun == count) return flow.stop(), nullptr;
      Block& block = ring[turn++ % kBlocksInFlight];
      block.particles = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count - begun));
      block.bytes.resize(block.particles * size);
      const std::size_t got = stream.fill(block.bytes.data(), block.particles * size);
      if (got < block.particles * size && stream.damaged()) throwDamaged(*this, stream);
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

    if (partial_) return;  // what follows the last whole particle is known to be wrong
    const bool more = stream.hasMore();
    if (stream.damaged()) throwDamaged(*this, stream);
    if (more || (stream.ended() && dataBegin_ + stream.bytesIn() < file_.bytes()))
      logWarning(fmt::format("{}: ignored data behind the last of its {} particles", path_, count));
    else if (!stream.ended())
      throw InputError(path_, "particle data", "a zlib stream with its checksum",
                       fmt::format("the file's end, after particle {} of {} and {} compressed bytes", count, count,
                                   stream.bytesIn()),
                       fmt::format("the file is cut off; {}", kRepair));
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles of {} bytes", path_, count, size));
  }
}

}  // namespace mote
