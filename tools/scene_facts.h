// A scene's sources as far as headers tell, and the memory that a frame of it takes.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "host/scene/scene.h"

namespace mote {

/// One source as far as its header or the scene tells.
struct SourceFacts {
  std::uint64_t count = 0;
  std::string from, radius;
  bool color = false, absorption = false, emission = false, velocity = false, id = false;
};
/// Opens the source's file of that frame. Throws InputError where it is missing or its header is wrong.
SourceFacts factsOf(const ParticleSource& source, int frame);
std::vector<SourceFacts> factsOf(const Scene& scene, int frame);
std::uint64_t particlesOf(const std::vector<SourceFacts>& facts);

/// Bytes that one frame holds at its peak: what grows with the particles or the picture, and the program itself. A test
/// holds the host's against renders.
struct MemoryNeed {
  double host = 0, device = 0;
};
/// `ahead`: the next frame's particles load while this one is drawn.
MemoryNeed memoryNeed(const Scene& scene, const std::vector<SourceFacts>& facts, bool ahead);
/// Whether a run of the scene loads ahead on this machine.
bool loadsAhead(const Scene& scene);

}  // namespace mote
