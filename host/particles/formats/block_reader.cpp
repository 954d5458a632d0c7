#include "host/particles/formats/block_reader.h"

#include <algorithm>
#include <limits>

#include "host/core/error.h"

namespace mote {
namespace {

/// What has come of one channel and is not yet handed on.
struct Waiting {
  std::size_t bytes = 0;        ///< a particle
  std::vector<std::byte> data;  ///< from `used` on
  std::size_t used = 0;

  std::size_t particles() const { return (data.size() - used) / bytes; }
  void add(std::vector<std::byte>&& piece) {
    if (used == data.size())
      data = std::move(piece), used = 0;
    else
      data.insert(data.end(), piece.begin(), piece.end());
  }
};

}  // namespace

void readBlocks(const ParticleFile& file, std::span<const std::string> channels, const BlockTaker& take) {
  std::vector<Waiting> waiting(channels.size());
  std::vector<RawTaker> takers(channels.size());
  std::vector<ChannelRequest> requests;
  std::vector<std::span<const std::byte>> columns(channels.size());
  const auto handOn = [&] {
    std::size_t ready = std::numeric_limits<std::size_t>::max();
    for (const Waiting& w : waiting) ready = std::min(ready, w.particles());
    if (ready == 0) return;
    for (std::size_t k = 0; k < waiting.size(); ++k) {
      Waiting& w = waiting[k];
      columns[k] = std::span(w.data).subspan(w.used, ready * w.bytes);
      w.used += ready * w.bytes;
    }
    take(columns, ready);
  };
  for (std::size_t k = 0; k < channels.size(); ++k) {
    const Channel* channel = file.channel(channels[k]);
    MOTE_CHECK(channel != nullptr, ==, true);
    waiting[k].bytes = channel->bytes();
    takers[k] = [&, k](std::vector<std::byte>&& piece) {
      waiting[k].add(std::move(piece));
      handOn();
    };
    requests.push_back({channels[k], &takers[k]});
  }
  file.read(requests);
}

}  // namespace mote
