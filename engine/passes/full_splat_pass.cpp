#include "engine/passes/full_splat_pass.h"

#include <algorithm>
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

bool hasLayerTargets(SplatLayers layers) { return layers.depth || layers.opticalDepth || layers.velocity; }

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

std::uint64_t FullSplatPass::ownCost(const Device& device, const SplatSet& set) {
  const auto cost = [&](const auto& sprite) {
    return sprite.empty() ? 0 : device.bufferCost(sprite.size() * sizeof(sprite[0]));
  };
  return cost(set.spriteColor) + cost(set.spriteOpacity) + device.bufferCost(sizeof(layout::SplatScene)) +
         device.stagingCost();
}

FullSplatPass::FullSplatPass(const Device& device, const SplatSet& set, std::uint32_t pointsPerSubmit)
    : device_(device),
      pointsPerSubmit_(pointsPerSubmit),
      width_(static_cast<std::uint32_t>(set.camera().imageSize.x)),
      height_(static_cast<std::uint32_t>(set.camera().imageSize.y)),
      scene_(set.scene),
      color_(device.createGraphicsPipeline(
          pipelineInfo(spirv::splat_full_frag, {{kColorFormat, Blend::DualSourceOver}}))) {
  MOTE_CHECK(pointsPerSubmit, >, 0u);
  requirePictureFits(device, width_, height_);
  spriteColor_ = bufferWith(device, set.spriteColor, scene_.spriteColor);
  spriteOpacity_ = bufferWith(device, set.spriteOpacity, scene_.spriteOpacity);
  sceneBuffer_ = device.createBuffer(sizeof(layout::SplatScene));
}

std::uint64_t FullSplatPass::downloadCost() const {
  return device_.bufferCost(std::uint64_t{width_} * height_ * sizeof(vec4), Memory::Host);
}

std::uint64_t FullSplatPass::drawingCost(bool surfaces, SplatLayers layers) const {
  const std::uint64_t color = device_.imageCost(width_, height_, kColorFormat);
  std::uint64_t sum = color + downloadCost();
  if (surfaces) sum += device_.bufferCost(std::uint64_t{width_} * height_ * sizeof(float));
  if (layers.colorAlpha) sum += color;
  if (hasLayerTargets(layers)) sum += color + 2 * device_.imageCost(width_, height_, kNumberFormat);
  return sum;
}

void FullSplatPass::begin(std::span<const float> surfaces, SplatLayers layers) {
  scene_.solidDepth = 0;
  if (!surfaces.empty()) {
    MOTE_CHECK(surfaces.size(), ==, std::size_t{width_} * height_);
    surface_ = device_.createBufferWith<float>(surfaces);
    scene_.solidDepth = surface_.address();
  }
  wanted_ = layers;
  drawn_ = false;
  const auto add = [&](const GraphicsPipeline& pipeline, bool alphaOnly, std::initializer_list<VkFormat> formats) {
    Drawing& drawing = drawings_.emplace_back(Drawing{&pipeline, alphaOnly, {}});
    for (const VkFormat format : formats) drawing.targets.push_back(device_.createImage(width_, height_, format));
  };
  add(color_, false, {kColorFormat});
  if (layers.colorAlpha) add(color_, true, {kColorFormat});
  if (!hasLayerTargets(layers)) return;
  if (!layers_) layers_ = device_.createGraphicsPipeline(layersInfo());
  add(*layers_, false, {kNumberFormat, kNumberFormat, kColorFormat});
}

void FullSplatPass::record(CommandBuffer& commands, const Drawing& drawing, const Buffer& order, std::uint32_t first,
                           std::uint32_t count, bool keep) const {
  const std::vector<Image2D>& targets = drawing.targets;
  if (targets.size() == 1)
    commands.beginRendering({{targets[0], {}, keep}});
  else
    commands.beginRendering(
        {{targets[0], VkClearColorValue{{kNoDepth}}, keep}, {targets[1], {}, keep}, {targets[2], {}, keep}});
  const layout::SplatFullParams params{sceneBuffer_.address(), drawing.alphaOnly ? 1u : 0u, 0};
  if (count > 0) commands.drawIndexed(*drawing.pipeline, params, order, count, first);
  commands.endRendering();
}

void FullSplatPass::draw(const SplatBuffers& splats, const Buffer& order, std::uint32_t count,
                         const std::function<void(std::uint32_t)>& progress) {
  MOTE_CHECK(count * std::uint64_t{sizeof(std::uint32_t)}, <=, order.size());
  scene_.particles = splats.particles.address();
  scene_.extinction = splats.extinction.address();
  scene_.emission = splats.emission.address();
  scene_.velocity = splats.velocity.address();
  device_.upload<layout::SplatScene>(sceneBuffer_, std::span(&scene_, 1));
  TimestampQueries queries = device_.createTimestampQueries(1);
  std::uint32_t first = 0;
  do {  // at least once: without points the targets may have to be cleared
    const std::uint32_t part = std::min(count - first, pointsPerSubmit_);
    for (const Drawing& drawing : drawings_) {
      queries.reset();
      device_.run([&](CommandBuffer& commands) {
        const std::uint32_t span = queries.begin(commands, "splat");
        record(commands, drawing, order, first, part, drawn_);
        queries.end(commands, span);
      });
      deviceSeconds_ += queries.results().at(0).seconds;
    }
    drawn_ = true;
    first += part;
    if (progress) progress(first);
  } while (first < count);
}

Image FullSplatPass::finish() {
  MOTE_CHECK(drawn_, ==, true);
  Image image(static_cast<int>(width_), static_cast<int>(height_));
  image.pixels = downloadPixels<vec4>(device_, drawings_[0].targets[0]);
  if (wanted_.colorAlpha)
    for (const vec4& p : downloadPixels<vec4>(device_, drawings_[1].targets[0])) image.alpha.push_back(vec3(p));
  const std::vector<Image2D>& layers = drawings_.back().targets;
  if (wanted_.depth) image.depth = downloadPixels<float>(device_, layers[0]);
  if (wanted_.opticalDepth) image.opticalDepth = downloadPixels<float>(device_, layers[1]);
  if (wanted_.velocity)
    for (const vec4& p : downloadPixels<vec4>(device_, layers[2])) image.velocity.push_back(vec2(p));
  drawings_.clear();
  surface_ = {};
  finishLayers(image);
  return image;
}

}  // namespace mote
