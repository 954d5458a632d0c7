#include "engine/passes/full_splat_pass.h"

#include <algorithm>
#include <array>
#include <bit>

#include "engine/passes/picture_size.h"
#include "host/core/error.h"
#include "host/splat/rasterize_full.h"
#include "host/splat/splat.h"
#include "spirv.h"

namespace mote {
namespace {

constexpr VkFormat kColorFormat = VK_FORMAT_R32G32B32A32_SFLOAT;
constexpr VkFormat kNumberFormat = VK_FORMAT_R32_SFLOAT;
// Ids in splat_layers.frag.
constexpr std::uint32_t kDepthAlphaId = 0, kNoDepthId = 1;

GraphicsPipelineInfo pipelineInfo(std::span<const std::uint32_t> fragment, std::vector<ColorTarget> targets) {
  GraphicsPipelineInfo info;
  info.vertex = spirv::splat_full_vert;
  info.geometry = spirv::splat_full_geom;
  info.fragment = fragment;
  info.targets = std::move(targets);
  info.pushConstantBytes = sizeof(layout::SplatFullParams);
  return info;
}

GraphicsPipelineInfo layersInfo() {
  GraphicsPipelineInfo info = pipelineInfo(
      spirv::splat_layers_frag,
      {{kNumberFormat, Blend::Min}, {kNumberFormat, Blend::Add}, {kColorFormat, Blend::PremultipliedOver}});
  info.constants = {{kDepthAlphaId, std::bit_cast<std::uint32_t>(kDepthAlpha)},
                    {kNoDepthId, std::bit_cast<std::uint32_t>(kNoDepth)}};
  return info;
}

template <class T>
Buffer bufferWith(const Device& device, const std::vector<T>& data, std::uint64_t& address) {
  if (data.empty()) {
    address = 0;
    return {};
  }
  Buffer buffer = device.createBufferWith<T>(data);
  address = buffer.address();
  return buffer;
}

template <class T>
std::vector<T> downloadPixels(const Device& device, const Image2D& from) {
  std::vector<T> pixels(std::size_t{from.width()} * from.height());
  const Buffer staging = device.createBuffer(pixels.size() * sizeof(T), Memory::Host);
  device.run([&](CommandBuffer& commands) { commands.copyToBuffer(from, staging); });
  device.downloadBytes(staging, 0, pixels.data(), pixels.size() * sizeof(T));
  return pixels;
}

}  // namespace

FullSplatPass::FullSplatPass(const Device& device, const SplatSet& set, const Buffer& particles,
                             std::uint32_t pointsPerSubmit)
    : device_(device),
      pointsPerSubmit_(pointsPerSubmit),
      width_(static_cast<std::uint32_t>(set.camera().imageSize.x)),
      height_(static_cast<std::uint32_t>(set.camera().imageSize.y)),
      scene_(set.scene),
      color_(device.createGraphicsPipeline(
          pipelineInfo(spirv::splat_full_frag, {{kColorFormat, Blend::DualSourceOver}}))) {
  MOTE_CHECK(pointsPerSubmit, >, 0u);
  requirePictureFits(device, width_, height_);
  scene_.particles = particles.address();
  extinction_ = bufferWith(device, set.extinction, scene_.extinction);
  emission_ = bufferWith(device, set.emission, scene_.emission);
  velocity_ = bufferWith(device, set.velocity, scene_.velocity);
  spriteColor_ = bufferWith(device, set.spriteColor, scene_.spriteColor);
  spriteOpacity_ = bufferWith(device, set.spriteOpacity, scene_.spriteOpacity);
  sceneBuffer_ = device.createBuffer(sizeof(layout::SplatScene));
}

void FullSplatPass::drawInto(const GraphicsPipeline& pipeline, std::span<const Image2D> targets,
                             std::span<const VkClearColorValue> clear, const Buffer& order, std::uint32_t count,
                             bool alphaOnly, const std::function<void(std::uint32_t)>& progress) {
  const layout::SplatFullParams params{sceneBuffer_.address(), alphaOnly ? 1u : 0u, 0};
  TimestampQueries queries = device_.createTimestampQueries(1);
  std::uint32_t first = 0;
  do {  // at least once: without points the targets must still be cleared
    const std::uint32_t part = std::min(count - first, pointsPerSubmit_);
    const bool keep = first > 0;
    queries.reset();
    device_.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries.begin(commands, "splat");
      if (targets.size() == 1)
        commands.beginRendering({{targets[0], clear[0], keep}});
      else
        commands.beginRendering(
            {{targets[0], clear[0], keep}, {targets[1], clear[1], keep}, {targets[2], clear[2], keep}});
      if (part > 0) commands.drawIndexed(pipeline, params, order, part, first);
      commands.endRendering();
      queries.end(commands, span);
    });
    deviceSeconds_ += queries.results().at(0).seconds;
    first += part;
    if (progress) progress(first);
  } while (first < count);
}

Image FullSplatPass::draw(const Buffer& order, std::uint32_t count, std::span<const float> surfaces, SplatLayers wanted,
                          const std::function<void(std::uint32_t)>& progress) {
  MOTE_CHECK(count * std::uint64_t{sizeof(std::uint32_t)}, <=, order.size());
  const std::size_t pixels = std::size_t{width_} * height_;
  Buffer surface;
  scene_.solidDepth = 0;
  if (!surfaces.empty()) {
    MOTE_CHECK(surfaces.size(), ==, pixels);
    surface = device_.createBufferWith<float>(surfaces);
    scene_.solidDepth = surface.address();
  }
  device_.upload<layout::SplatScene>(sceneBuffer_, std::span(&scene_, 1));

  Image image(static_cast<int>(width_), static_cast<int>(height_));
  const std::array<VkClearColorValue, 3> black{};
  std::array<Image2D, 1> color{device_.createImage(width_, height_, kColorFormat)};
  drawInto(color_, color, black, order, count, false, progress);
  image.pixels = downloadPixels<vec4>(device_, color[0]);
  if (wanted.colorAlpha) {
    drawInto(color_, color, black, order, count, true, {});
    for (const vec4& p : downloadPixels<vec4>(device_, color[0])) image.alpha.push_back(vec3(p));
  }
  if (wanted.depth || wanted.opticalDepth || wanted.velocity) {
    if (!layers_) layers_ = device_.createGraphicsPipeline(layersInfo());
    const std::array<Image2D, 3> targets{device_.createImage(width_, height_, kNumberFormat),
                                         device_.createImage(width_, height_, kNumberFormat),
                                         device_.createImage(width_, height_, kColorFormat)};
    const std::array<VkClearColorValue, 3> clear{VkClearColorValue{{kNoDepth}}, VkClearColorValue{},
                                                 VkClearColorValue{}};
    drawInto(*layers_, targets, clear, order, count, false, {});
    if (wanted.depth) image.depth = downloadPixels<float>(device_, targets[0]);
    if (wanted.opticalDepth) image.opticalDepth = downloadPixels<float>(device_, targets[1]);
    if (wanted.velocity)
      for (const vec4& p : downloadPixels<vec4>(device_, targets[2])) image.velocity.push_back(vec2(p));
  }
  deviceBytes_ = extinction_.size() + emission_.size() + velocity_.size() + spriteColor_.size() +
                 spriteOpacity_.size() + surface.size() + order.size() + pixels * (wanted.any() ? 40 : 16);
  finishLayers(image);
  return image;
}

}  // namespace mote
