#include "engine/passes/splat_pass.h"

#include <algorithm>
#include <bit>

#include "engine/passes/picture_size.h"
#include "host/core/error.h"
#include "host/splat/splat.h"
#include "shaders/glsl/layout/splat_params.h"
#include "spirv.h"

namespace mote {
namespace {

constexpr VkFormat kColorFormat = VK_FORMAT_R32G32B32A32_SFLOAT;
constexpr VkFormat kDepthFormat = VK_FORMAT_R32_SFLOAT;
// Ids in splat.frag.
constexpr std::uint32_t kFalloffId = 0, kDepthAlphaId = 1, kNoDepthId = 2;

/// Wider points waste more of their square than they save.
constexpr float kMostPointSide = 64;

GraphicsPipelineInfo pipelineInfo(layout::uint falloff, bool withDepth, bool points) {
  GraphicsPipelineInfo info;
  info.vertex = points ? std::span<const std::uint32_t>(spirv::splat_point_vert) : spirv::splat_vert;
  if (!points) info.geometry = spirv::splat_geom;
  info.fragment = spirv::splat_frag;
  info.targets = {{kColorFormat, Blend::PremultipliedOver}};
  if (withDepth) info.targets.push_back({kDepthFormat, Blend::Min});
  info.pushConstantBytes = sizeof(layout::SplatParams);
  info.constants = {{kFalloffId, falloff},
                    {kDepthAlphaId, std::bit_cast<std::uint32_t>(kDepthAlpha)},
                    {kNoDepthId, std::bit_cast<std::uint32_t>(kNoDepth)}};
  return info;
}

void download(const Device& device, const Image2D& from, void* data, std::size_t bytes) {
  const Buffer staging = device.createBuffer(bytes, Memory::Host);
  device.run([&](CommandBuffer& commands) { commands.copyToBuffer(from, staging); });
  device.downloadBytes(staging, 0, data, bytes);
}

}  // namespace

SplatPass::SplatPass(const Device& device, layout::uint falloff, bool withDepth, std::uint32_t pointsPerSubmit)
    : device_(device), falloff_(falloff), withDepth_(withDepth), pointsPerSubmit_(pointsPerSubmit) {
  MOTE_CHECK(pointsPerSubmit, >, 0u);
}

const GraphicsPipeline& SplatPass::pipeline(bool points) const {
  GraphicsPipeline& made = points ? points_ : quads_;
  if (made.handle() == VK_NULL_HANDLE)
    made = device_.createGraphicsPipeline(pipelineInfo(falloff_, withDepth_, points));
  return made;
}

float SplatPass::smallSide(const Device& device) {
  // A point may be a pixel wider than the splat.
  return device.mostPointSide() < 2 ? 0 : std::min(device.mostPointSide(), kMostPointSide) - 1;
}

std::uint64_t SplatPass::downloadCost(std::uint32_t width, std::uint32_t height) const {
  return device_.bufferCost(std::uint64_t{width} * height * sizeof(vec4), Memory::Host);
}

std::uint64_t SplatPass::drawingCost(std::uint32_t width, std::uint32_t height) const {
  requirePictureFits(device_, width, height);
  return device_.imageCost(width, height, kColorFormat) +
         (withDepth_ ? device_.imageCost(width, height, kDepthFormat) : 0) + downloadCost(width, height);
}

SplatTarget SplatPass::createTarget(std::uint32_t width, std::uint32_t height) const {
  requirePictureFits(device_, width, height);
  SplatTarget target;
  target.color = device_.createImage(width, height, kColorFormat);
  if (withDepth_) target.depth = device_.createImage(width, height, kDepthFormat);
  return target;
}

void SplatPass::record(CommandBuffer& commands, const SplatTarget& target, const Buffer& particles, const Buffer& order,
                       std::uint32_t first, std::uint32_t count, const layout::SplatCamera& camera, bool keep,
                       std::uint32_t small) const {
  MOTE_CHECK((std::uint64_t{first} + count) * sizeof(std::uint32_t), <=, order.size());
  MOTE_CHECK(camera.falloff, ==, falloff_);
  MOTE_CHECK(camera.imageSize.x, ==, static_cast<float>(target.color.width()));
  MOTE_CHECK(camera.imageSize.y, ==, static_cast<float>(target.color.height()));
  const RenderTarget color{target.color, VkClearColorValue{}, keep};
  if (withDepth_)
    commands.beginRendering({color, {target.depth, VkClearColorValue{{kNoDepth}}, keep}});
  else
    commands.beginRendering({color});
  const layout::SplatParams params{.particles = particles.address(), .camera = camera, .pad = 0};
  const std::uint32_t points = std::clamp(small, first, first + count) - first;
  if (points > 0) commands.drawIndexed(pipeline(true), params, order, points, first);
  if (points < count) commands.drawIndexed(pipeline(false), params, order, count - points, first + points);
  commands.endRendering();
}

std::uint32_t SplatPass::submissions(std::uint32_t count) const {
  return count == 0 ? 1 : (count - 1) / pointsPerSubmit_ + 1;
}

void SplatPass::draw(const SplatTarget& target, const Buffer& particles, const Buffer& order, std::uint32_t count,
                     const layout::SplatCamera& camera, TimestampQueries* times,
                     const std::function<void(std::uint32_t)>& progress, bool keep, std::uint32_t small) const {
  std::uint32_t first = 0;
  do {  // at least once: without points the target may have to be cleared
    const std::uint32_t part = std::min(count - first, pointsPerSubmit_);
    device_.run([&](CommandBuffer& commands) {
      const std::uint32_t span = times ? times->begin(commands, "splat") : 0;
      record(commands, target, particles, order, first, part, camera, keep || first > 0, small);
      if (times) times->end(commands, span);
    });
    first += part;
    if (progress) progress(first);
  } while (first < count);
}

Image SplatPass::download(const SplatTarget& target) const {
  Image image(static_cast<int>(target.color.width()), static_cast<int>(target.color.height()), withDepth_);
  mote::download(device_, target.color, image.pixels.data(), image.pixels.size() * sizeof(vec4));
  if (withDepth_) mote::download(device_, target.depth, image.depth.data(), image.depth.size() * sizeof(float));
  return image;
}

}  // namespace mote
