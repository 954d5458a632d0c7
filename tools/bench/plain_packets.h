// The yardstick of exact lighting: packets of sixteen rays as anybody would write them first.
#pragma once
#include <vector>

#include "host/lighting/lighting.h"

namespace mote {

/// Optical depths of every slot toward one light, as mote::opticalDepths with falloff smooth and soft ends. Sixteen
/// neighbours in Morton order walk the tree together: a node is entered if any of their rays touches its box, and each
/// particle of a leaf is held against all sixteen (best with leaves of 32). Leaves that lie wholly between the ends of
/// all rays go without end caps. Vectors and fused multiply-adds by Google Highway, packets on TBB, stops by the
/// cutoff.
std::vector<float> plainPacketDepths(const Octree& tree, const layout::Light& light, const LightingOptions& options);

/// The leaf size that suits it.
constexpr std::uint32_t kPlainPacketLeaf = 32;

}  // namespace mote
