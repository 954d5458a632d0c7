// Which vector instructions the kernels run on: Google Highway compiles each for several instruction sets and chooses
// when it is called. Results do not depend on the choice, bit for bit (tests/cli/determinism_test.cpp).
#pragma once
#include <string>
#include <vector>

namespace mote {

/// Instruction sets, by Highway's names (AVX3 is AVX-512), that this machine has and the kernels are compiled for, best
/// first; the last is the portable code.
std::vector<std::string> simdTargets();
/// The one that a kernel runs on that is called now: what Highway's dispatch comes to, not what it should.
std::string simdTargetInUse();

/// From now on the kernels use `name` or what is narrower, and simdTargets() lists no other. Throws InputError, naming
/// `place` and those there are, for another name.
void limitSimdTargets(const std::string& place, const std::string& name);

/// Holds all kernels to one of simdTargets(), "" frees them again; for tests and benchmarks. Throws InputError on
/// another name.
void useSimdTarget(const std::string& name);

}  // namespace mote
