#include "engine/passes/light_pass.h"

#include <algorithm>
#include <array>

#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/lighting/packet.h"
#include "host/lighting/ray_order.h"
#include "spirv.h"

namespace mote {
namespace {

/// A multiple of every subgroup size there is (4–64), so that no subgroup is partly empty.
constexpr std::uint32_t kGroupSize = 64;
/// Rays an invocation: hardware hides latency with occupancy, which registers limit; lavapipe has no latency to hide
/// and wants each load to serve many rays (measured: 1 → 2×, 2 → 1.35×, 4 → 1.08×, 8 → 1× the time).
constexpr std::uint32_t kRaysOnCpu = 8, kRaysOnHardware = 1;
/// Rays a submission: seconds at most, so that no watchdog of a display driver ends it and progress can be shown.
constexpr std::uint32_t kRaysPerSubmit = 1 << 17;

std::uint32_t raysPerInvocation(const Device& device) { return device.isCpu() ? kRaysOnCpu : kRaysOnHardware; }

}  // namespace

LightPass::LightPass(const Device& device, layout::uint falloff, layout::uint endpoint)
    : device_(device),
      queries_(device.createTimestampQueries(1)),
      falloff_(falloff),
      endpoint_(endpoint),
      raysPerGroup_(kGroupSize * raysPerInvocation(device)) {}

void LightPass::createPipeline(bool exact) {
  const std::array constants{SpecializationConstant{0, kGroupSize},
                             SpecializationConstant{1, raysPerInvocation(device_)}, SpecializationConstant{2, falloff_},
                             SpecializationConstant{3, endpoint_}};
  pipeline_ = device_.createComputePipeline(exact ? spirv::light_exact_comp : spirv::light_comp,
                                            sizeof(layout::LightParams), constants);
}

void LightPass::setTree(const Octree& tree) {
  tree_ = &tree;
  const PacketRules rules = packetRules(tree);
  const bool small = glm::length(tree.bounds().size()) > rules.farDistance;
  if (small && !device_.hasFloat64())
    logVerbose("this device has no shaderFloat64: particles beyond 256 of the smallest radius are lit less exactly");
  createPipeline(small && device_.hasFloat64());
  const std::size_t count = tree.particleCount();
  nodes_ = device_.createBufferWith<layout::Node>(tree.nodes);
  peaks_ = device_.createBufferWith<float>(std::span(tree.peak).first(count));
  particles_ = device_.createBuffer(count * sizeof(vec4));
  // Interleaved in pieces: no second copy of all particles on the host.
  constexpr std::size_t kPiece = 1 << 20;
  std::vector<vec4> piece;
  for (std::size_t begin = 0; begin < count; begin += kPiece) {
    piece.resize(std::min(kPiece, count - begin));
    parallelBlocks(piece.size(), 1 << 14, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) piece[i] = vec4(tree.position(begin + i), tree.radius[begin + i]);
    });
    device_.upload<vec4>(particles_, piece, begin);
  }
}

std::vector<float> LightPass::opticalDepths(const layout::Light& light, float cutoff, const RaysDone& done) {
  const std::size_t count = tree_->particleCount();
  if (count == 0 || light.castsShadows == 0 || light.shadowDensity == 0) return std::vector<float>(count, 0.0f);
  const Buffer order = device_.createBufferWith<std::uint32_t>(rayOrder(*tree_, light));
  const Buffer depths = device_.createBuffer(count * sizeof(float));
  deviceBytes_ = nodes_.size() + particles_.size() + peaks_.size() + order.size() + depths.size();
  layout::LightParams params{};
  params.nodes = nodes_.address();
  params.particles = particles_.address();
  params.peaks = peaks_.address();
  params.order = order.address();
  params.opticalDepths = depths.address();
  params.lightPosition = light.position;
  params.lightType = light.type;
  params.lightDirection = light.direction;
  params.opticalDepthLimit = opticalDepthLimit(light, cutoff);
  params.nodeCount = static_cast<layout::uint>(tree_->nodeCount());
  params.boxSlack = packetRules(*tree_).slack;
  dispatch(params, done);
  return device_.download<float>(depths, count);
}

void LightPass::dispatch(layout::LightParams params, const RaysDone& done) {
  const auto count = static_cast<std::uint32_t>(tree_->particleCount());
  for (std::uint32_t first = 0; first < count; first += params.rayCount) {
    params.firstRay = first;
    params.rayCount = std::min(kRaysPerSubmit, count - first);
    queries_.reset();
    device_.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries_.begin(commands, "lighting");
      commands.dispatchRow(pipeline_, params, (params.rayCount + raysPerGroup_ - 1) / raysPerGroup_);
      queries_.end(commands, span);
    });
    deviceSeconds_ += queries_.results().at(0).seconds;
    if (done) done(params.rayCount);
  }
}

}  // namespace mote
