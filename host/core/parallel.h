// The number of threads, and loops whose results do not depend on it.
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <cstddef>

namespace mote {

/// Limits TBB to `threads` workers while it lives; 0 keeps one a core.
class ThreadLimit {
 public:
  explicit ThreadLimit(unsigned threads);

 private:
  tbb::global_control control_;
};

/// Threads that parallel loops may use now.
unsigned threadCount();

/// Calls body(begin, end) for consecutive blocks of at most `grain` items. The blocks are the same for any number of
/// threads, so a body that writes only its own items, or one partial result a block, gives the same bytes always.
template <class Body>
void parallelBlocks(std::size_t count, std::size_t grain, const Body& body) {
  const std::size_t blocks = (count + grain - 1) / grain;
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
    const std::size_t begin = block * grain;
    body(begin, begin + grain < count ? begin + grain : count);
  });
}

}  // namespace mote
