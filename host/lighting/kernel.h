// The walk of one packet through the tree: the scalar path and the SIMD paths, equal bit for bit.
#pragma once
#include <string>
#include <vector>

#include "host/lighting/packet.h"

namespace mote {

/// What a walk needs beside the packet.
struct WalkOptions {
  layout::uint falloff = layout::kFalloffSmooth;
  layout::uint endpoint = layout::kEndpointSoft;
  float opticalDepthLimit =
      std::numeric_limits<float>::infinity();  ///< stop once every ray is beyond, in every channel
};

/// Adds every particle's share to packet.opticalDepth, channel by channel of the tree.
void walkScalar(const Octree& tree, const WalkOptions& options, Packet& packet);
/// The same with the best instruction set of this machine, chosen at the first call (Google Highway).
void walkSimd(const Octree& tree, const WalkOptions& options, Packet& packet);

/// Instruction sets that walkSimd may use on this machine, best first.
std::vector<std::string> simdTargets();
/// Holds walkSimd to one of them, "" frees it again; for tests and benchmarks. Throws InputError on another name.
void useSimdTarget(const std::string& name);

}  // namespace mote
