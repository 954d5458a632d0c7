#include "host/particles/formats/npy_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/section.h"

namespace mote {

bool beginsAsNpy(std::span<const std::byte> start) {
  return start.size() >= sizeof kNpyMagic && std::memcmp(start.data(), kNpyMagic, sizeof kNpyMagic) == 0;
}

NpyReader::NpyReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  Section section(file_, 0, file_.bytes());
  const NpyArray array = readNpyHeader(
      path_, [&](std::uint64_t count, std::string_view what) { return section.bytes(count, what); }, file_.bytes());
  format_ = "NPY " + array.version;
  dataBegin_ = array.dataBegin;
  table_ = npyTable(path_, array);
  count_ = table_.count;
  const std::uint64_t left = file_.bytes() - dataBegin_, rowBytes = table_.rowBytes;
  if (count_ > left / rowBytes)
    throw InputError(
        path_, "shape",
        fmt::format("at most {} particles of {} bytes, as {} bytes follow the header", left / rowBytes, rowBytes, left),
        fmt::format("{}", count_), "the file is cut off");
  for (const PlacedChannel& placed : table_.channels) channels_.push_back(placed.channel);
  if (left > count_ * rowBytes)
    logWarning(fmt::format("{}: ignored {} bytes behind the last of its {} particles", path_, left - count_ * rowBytes,
                           count_));
}

void NpyReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  const auto fill = [&](std::byte* to, std::uint64_t from, std::size_t bytes) {
    file_.seek(dataBegin_ + from);
    if (file_.read(to, bytes) != bytes)
      throw InputError(path_, "particle data", fmt::format("{} bytes at byte {}", bytes, dataBegin_ + from),
                       "the file's end", "it became shorter while it was read");
  };
  try {
    for (ChannelSink& sink : sinks) sink.reserve(count_);
    NpyRows rows(table_, fill);
    for (std::uint64_t first = 0; first < count_; first += rows.perBlock()) {
      const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(rows.perBlock(), count_ - first));
      const std::byte* block = rows.read(first, here);
      for (ChannelSink& sink : sinks)
        sink.append(block + table_.channels[sink.index()].offset, table_.rowBytes, here, table_.bigEndian);
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(
        fmt::format("{}: not enough memory for {} particles of {} bytes", path_, count_, table_.rowBytes));
  }
}

}  // namespace mote
