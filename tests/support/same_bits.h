// Results that depend neither on the instruction set nor on the number of threads.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "host/core/parallel.h"
#include "host/core/simd_targets.h"

namespace mote {

/// once() gives the same bits on every instruction set of this machine and on 1, 2 and 7 threads.
template <class Once>
void expectSameBits(const Once& once) {
  const auto best = once();
  for (const std::string& target : simdTargets()) {
    useSimdTarget(target);
    EXPECT_EQ(once(), best) << target;
  }
  useSimdTarget("");
  for (const unsigned threads : {1u, 2u, 7u}) {
    const ThreadLimit limit(threads);
    EXPECT_EQ(once(), best) << threads;
  }
}

}  // namespace mote
