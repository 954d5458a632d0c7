// The depth order of more particles than a device can sort at once.
#pragma once
#include <span>
#include <vector>

#include "engine/vulkan/device.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

/// The order of sortByDepth (host/splat/splat.h), bit for bit: runs of as many particles as the device's budget allows,
/// 40 bytes each, get their keys and are sorted there, and are merged on the host, 12 bytes a particle. `keyScale` as
/// depthKeyScale. Device seconds, from timestamps, are added to `deviceSeconds`. Throws MachineError where the budget
/// has not even room for a run of 1024.
std::vector<layout::uint> depthOrderInRuns(const Device& device, std::span<const layout::SplatParticle> particles,
                                           const layout::SplatCamera& camera, float keyScale, double& deviceSeconds);

}  // namespace mote
