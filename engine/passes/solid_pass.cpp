#include "engine/passes/solid_pass.h"

#include <algorithm>
#include <array>

#include "engine/passes/part_size.h"
#include "host/core/error.h"
#include "shaders/glsl/layout/solid.h"
#include "spirv.h"

namespace mote {
namespace {

constexpr std::uint32_t kGroupSize = 64;         // a multiple of every subgroup size in use (4–64)
constexpr std::size_t kRaysPerSubmit = 1 << 20;  // seconds at most, so that no watchdog of a display driver ends it

/// Indices of the receivers to ask.
std::vector<std::uint32_t> asked(std::size_t count, std::span<const std::uint8_t> wanted) {
  std::vector<std::uint32_t> indices;
  indices.reserve(count);
  for (std::size_t k = 0; k < count; ++k)
    if (wanted.empty() || wanted[k] != 0) indices.push_back(static_cast<std::uint32_t>(k));
  return indices;
}

}  // namespace

SolidPass::SolidPass(const Device& device)
    : device_(device),
      pipeline_(device.createComputePipeline(spirv::solid_shadow_comp, sizeof(layout::SolidShadowParams),
                                             std::array{SpecializationConstant{0, kGroupSize}})),
      queries_(device.createTimestampQueries(1)) {}

void SolidPass::setTree(const SolidTree& tree) {
  nodeCount_ = static_cast<layout::uint>(tree.nodeCount());
  nodes_ = device_.createBufferWith<layout::Node>(tree.nodes);
  triangles_ = device_.createBufferWith<layout::Triangle>(tree.triangles);
}

std::vector<std::uint8_t> SolidPass::occluded(const Receivers& receivers, std::span<const std::uint8_t> wanted,
                                              const layout::Light& light) {
  if (!wanted.empty()) MOTE_CHECK(wanted.size(), ==, receivers.size());
  std::vector<std::uint8_t> result(receivers.size(), 0);
  if (nodeCount_ == 0 || light.castsShadows == 0) return result;
  const std::vector<std::uint32_t> rays = asked(receivers.size(), wanted);
  const auto sizes = [](std::uint64_t count) { return std::vector<std::uint64_t>(4, count * sizeof(float)); };
  const auto most = static_cast<std::size_t>(partThatFits(device_, std::min(kRaysPerSubmit, rays.size()), kLeastPart,
                                                          sizes, device_.stagingCost(), "shadow rays past solids"));
  const std::array<std::span<const float>, 3> sources{receivers.x, receivers.y, receivers.z};
  std::array<Buffer, 3> origins;
  for (Buffer& buffer : origins) buffer = device_.createBuffer(most * sizeof(float));
  const Buffer flags = device_.createBuffer(most * sizeof(std::uint32_t));
  std::vector<float> gathered(most);
  for (std::size_t begin = 0; begin < rays.size(); begin += most) {
    const std::size_t count = std::min(most, rays.size() - begin);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t k = 0; k < count; ++k) gathered[k] = sources[axis][rays[begin + k]];
      device_.upload<float>(origins[axis], std::span(gathered).first(count));
    }
    const layout::SolidShadowParams params{nodes_.address(),
                                           triangles_.address(),
                                           origins[0].address(),
                                           origins[1].address(),
                                           origins[2].address(),
                                           flags.address(),
                                           light.position,
                                           light.type,
                                           light.direction,
                                           nodeCount_,
                                           static_cast<layout::uint>(count),
                                           0};
    queries_.reset();
    device_.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries_.begin(commands, "solid shadows");
      commands.dispatchRow(pipeline_, params, (count + kGroupSize - 1) / kGroupSize);
      queries_.end(commands, span);
    });
    deviceSeconds_ += queries_.results().at(0).seconds;
    const std::vector<std::uint32_t> blocked = device_.download<std::uint32_t>(flags, count);
    for (std::size_t k = 0; k < count; ++k) result[rays[begin + k]] = static_cast<std::uint8_t>(blocked[k]);
  }
  return result;
}

}  // namespace mote
