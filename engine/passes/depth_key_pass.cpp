#include "engine/passes/depth_key_pass.h"

#include <array>

#include "shaders/glsl/layout/sort.h"
#include "spirv.h"

namespace mote {
namespace {

constexpr std::uint32_t kGroupSize = 64;  // a multiple of every subgroup size in use (4–64)

}  // namespace

DepthKeyPass::DepthKeyPass(const Device& device)
    : pipeline_(device.createComputePipeline(spirv::depth_key_comp, sizeof(layout::DepthKeyParams),
                                             std::array{SpecializationConstant{0, kGroupSize}})) {}

void DepthKeyPass::record(CommandBuffer& commands, const Buffer& particles, std::uint32_t count, const vec3& camera,
                          float scale, const Buffer& pairs, const vec3& axis) const {
  MOTE_CHECK(particles.size(), >=, count * std::uint64_t{sizeof(layout::SplatParticle)});
  MOTE_CHECK(pairs.size(), >=, count * std::uint64_t{sizeof(layout::SortPair)});
  const layout::DepthKeyParams params{particles.address(), pairs.address(), camera, scale, axis, count};
  commands.dispatchRow(pipeline_, params, (std::uint64_t{count} + kGroupSize - 1) / kGroupSize);
}

}  // namespace mote
