#include "host/core/sampling.h"

#include <tbb/parallel_sort.h>

#include <vector>

#include "host/core/random.h"

namespace mote {
namespace {

/// Sets the choice apart from everything else that a seed decides.
constexpr std::uint64_t kSampleStream = 0x5a3b1e;

}  // namespace

bool isSampled(std::uint64_t id, std::uint64_t seed, float fraction) {
  return uniformDouble(hashBits(seed, id, kSampleStream)) < fraction;
}

double meanIdShare(std::span<const std::uint64_t> ids) {
  std::vector<std::uint64_t> sorted(ids.begin(), ids.end());
  tbb::parallel_sort(sorted.begin(), sorted.end());
  double pairs = 0;
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    while (end < sorted.size() && sorted[end] == sorted[begin]) ++end;
    pairs += double(end - begin) * double(end - begin);
  }
  return sorted.empty() ? 0 : pairs / static_cast<double>(sorted.size());
}

}  // namespace mote
