#include "host/core/parallel.h"

#include <thread>

namespace mote {

ThreadLimit::ThreadLimit(unsigned threads)
    : control_(tbb::global_control::max_allowed_parallelism,
               threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency())) {}

unsigned threadCount() {
  return static_cast<unsigned>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

}  // namespace mote
