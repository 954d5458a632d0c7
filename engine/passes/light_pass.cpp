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

/// Points as (x, y, z, w) with w from `fourth` (empty: 0), interleaved in pieces: no second copy of all on the host.
Buffer uploadPoints(const Device& device, const Receivers& points, std::span<const float> fourth) {
  constexpr std::size_t kPiece = 1 << 20;
  Buffer buffer = device.createBuffer(points.size() * sizeof(vec4));
  std::vector<vec4> piece;
  for (std::size_t begin = 0; begin < points.size(); begin += kPiece) {
    piece.resize(std::min(kPiece, points.size() - begin));
    parallelBlocks(piece.size(), 1 << 14, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i)
        piece[i] = vec4(points.position(begin + i), fourth.empty() ? 0.0f : fourth[begin + i]);
    });
    device.upload<vec4>(buffer, piece, begin);
  }
  return buffer;
}

}  // namespace

LightPass::LightPass(const Device& device, layout::uint falloff, layout::uint endpoint)
    : device_(device),
      queries_(device.createTimestampQueries(1)),
      falloff_(falloff),
      endpoint_(endpoint),
      raysPerGroup_(kGroupSize * raysPerInvocation(device)) {}

const ComputePipeline& LightPass::pipeline(bool ownSlots) {
  std::optional<ComputePipeline>& pipeline = ownSlots ? ownSlots_ : others_;
  if (!pipeline) {
    const std::array constants{SpecializationConstant{0, kGroupSize},
                               SpecializationConstant{1, raysPerInvocation(device_)},
                               SpecializationConstant{2, falloff_},
                               SpecializationConstant{3, endpoint_},
                               SpecializationConstant{4, static_cast<std::uint32_t>(tree_->channels())},
                               SpecializationConstant{5, ownSlots ? 1u : 0u}};
    pipeline = device_.createComputePipeline(exact_ ? spirv::light_exact_comp : spirv::light_comp,
                                             sizeof(layout::LightParams), constants);
  }
  return *pipeline;
}

void LightPass::setTree(const Octree& tree) {
  tree_ = &tree;
  ownSlots_.reset(), others_.reset();
  const bool small = glm::length(tree.bounds().size()) > packetRules(tree, {}).farDistance;
  if (small && !device_.hasFloat64())
    logVerbose("this device has no shaderFloat64: particles beyond 256 of the smallest radius are lit less exactly");
  exact_ = small && device_.hasFloat64();
  const std::size_t count = tree.particleCount();
  nodes_ = device_.createBufferWith<layout::Node>(tree.nodes);
  peaks_ = device_.createBufferWith<float>(std::span(tree.peak).first(count));
  if (tree.channels() == 3) {
    peaksGreen_ = device_.createBufferWith<float>(std::span(tree.peakGreen).first(count));
    peaksBlue_ = device_.createBufferWith<float>(std::span(tree.peakBlue).first(count));
  }
  particles_ = uploadPoints(device_, slotsOf(tree), tree.radius);
}

std::vector<float> LightPass::opticalDepths(const layout::Light& light, const LightingOptions& options,
                                            const RaysDone& done) {
  return opticalDepths(slotsOf(*tree_), light, options, {}, done);
}

std::vector<float> LightPass::opticalDepths(const Receivers& receivers, const layout::Light& light,
                                            const LightingOptions& options, std::span<const std::uint8_t> reached,
                                            const RaysDone& done) {
  MOTE_CHECK(options.falloff, ==, falloff_);
  MOTE_CHECK(options.endpoint, ==, endpoint_);
  const std::size_t count = receivers.size(), numbers = tree_->channels() * count;
  if (shadowless(light) || tree_->particleCount() == 0) return std::vector<float>(numbers, 0.0f);
  const std::vector<std::uint32_t> rays = rayOrder(receivers, light, reached);
  if (rays.empty()) return std::vector<float>(numbers, 0.0f);

  const bool ownSlots = receivers.self.empty() && receivers.x.data() == tree_->x.data();
  Buffer origins, selves;
  if (!ownSlots) {
    std::vector<std::uint32_t> self(count);
    for (std::size_t k = 0; k < count; ++k) self[k] = receivers.selfOf(k);
    origins = uploadPoints(device_, receivers, {});
    selves = device_.createBufferWith<std::uint32_t>(self);
  }
  const Buffer order = device_.createBufferWith<std::uint32_t>(rays);
  // Receivers without a ray keep the zeros.
  const Buffer depths = device_.createBufferWith<float>(std::vector<float>(numbers, 0.0f));
  deviceBytes_ =
      std::max(deviceBytes_, nodes_.size() + particles_.size() + peaks_.size() + peaksGreen_.size() +
                                 peaksBlue_.size() + origins.size() + selves.size() + order.size() + depths.size());
  layout::LightParams params{};
  params.nodes = nodes_.address();
  params.particles = particles_.address();
  params.peaks = peaks_.address();
  if (tree_->channels() == 3) params.peaksGreen = peaksGreen_.address(), params.peaksBlue = peaksBlue_.address();
  params.origins = ownSlots ? particles_.address() : origins.address();
  if (!ownSlots) params.selves = selves.address();
  params.order = order.address();
  params.opticalDepths = depths.address();
  params.lightPosition = light.position;
  params.lightType = light.type;
  params.lightDirection = light.direction;
  params.opticalDepthLimit = opticalDepthLimit(light, options);
  params.nodeCount = static_cast<layout::uint>(tree_->nodeCount());
  params.boxSlack = packetRules(*tree_, receivers.bounds()).slack;
  params.receiverCount = static_cast<layout::uint>(count);
  dispatch(pipeline(ownSlots), params, rays.size(), done);
  return device_.download<float>(depths, numbers);
}

void LightPass::dispatch(const ComputePipeline& pipeline, layout::LightParams params, std::size_t rays,
                         const RaysDone& done) {
  const auto count = static_cast<std::uint32_t>(rays);
  for (std::uint32_t first = 0; first < count; first += params.rayCount) {
    params.firstRay = first;
    params.rayCount = std::min(kRaysPerSubmit, count - first);
    queries_.reset();
    device_.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries_.begin(commands, "lighting");
      commands.dispatchRow(pipeline, params, (params.rayCount + raysPerGroup_ - 1) / raysPerGroup_);
      queries_.end(commands, span);
    });
    deviceSeconds_ += queries_.results().at(0).seconds;
    if (done) done(params.rayCount);
  }
}

}  // namespace mote
