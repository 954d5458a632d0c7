#include "engine/rasterizer.h"

#include <algorithm>

#include "engine/passes/depth_key_pass.h"
#include "engine/passes/full_splat_pass.h"
#include "engine/passes/sort_pass.h"
#include "engine/passes/splat_pass.h"
#include "engine/vulkan/barrier.h"
#include "host/core/log.h"
#include "host/core/timer.h"
#include "host/splat/rasterize_full.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

/// True where the fast way draws all that is asked for.
bool fast(const SplatSet& set, std::span<const float> surfaces, SplatLayers layers) {
  return set.plain() && surfaces.empty() && !layers.opticalDepth && !layers.velocity && !layers.colorAlpha;
}

class HostRasterizer : public Rasterizer {
 public:
  HostRasterizer(SplatSet set, float keyScale, FrameStats& stats) : set_(std::move(set)), stats_(stats) {
    Timer timer;
    order_ = sortByDepth(set_.particles, set_.camera(), keyScale);
    stats_.seconds["sort"] += timer.lap();
  }

  Image draw(std::span<const float> surfaces, SplatLayers layers) override {
    Timer timer;
    Image image = fast(set_, surfaces, layers) ? rasterize(set_.particles, order_, set_.camera(), layers.depth)
                                               : rasterizeFull(set_, order_, surfaces, layers);
    stats_.seconds["splat"] += timer.lap();
    return image;
  }

  void relight(std::vector<layout::SplatParticle> particles, bool emission) override {
    set_.particles = std::move(particles);
    if (!emission) set_.emission.clear();
  }

  const SplatSet& set() const override { return set_; }
  const std::vector<layout::uint>& order() const override { return order_; }

 private:
  SplatSet set_;
  FrameStats& stats_;
  std::vector<layout::uint> order_;
};

class DeviceRasterizer : public Rasterizer {
 public:
  DeviceRasterizer(const Device& device, SplatSet set, float keyScale, FrameStats& stats)
      : device_(device),
        set_(std::move(set)),
        stats_(stats),
        count_(static_cast<std::uint32_t>(set_.particles.size())) {
    Timer timer;
    particles_ = device.createBufferWith<layout::SplatParticle>(set_.particles);
    indices_ = device.createBuffer(count_ * sizeof(std::uint32_t));
    const Buffer pairs = device.createBuffer(SortPass::pairBytes(count_));
    const DepthKeyPass keys(device);
    const SortPass sort(device);
    TimestampQueries queries = device.createTimestampQueries(1);
    device.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries.begin(commands, "sort");
      keys.record(commands, particles_, count_, set_.camera().position, keyScale, pairs, viewAxis(set_.camera()));
      sort.record(commands, pairs, count_);
      sort.recordExtract(commands, pairs, count_, indices_);
      queries.end(commands, span);
      commands.barrier(barrier::computeToIndexAndVertexInput);
    });
    for (const StageTime& time : queries.results()) stats_.deviceSeconds[time.stage] += time.seconds;
    holds(particles_.size() + indices_.size() + pairs.size());
    stats_.seconds["sort"] += timer.lap();
  }

  Image draw(std::span<const float> surfaces, SplatLayers layers) override {
    Timer timer;
    Progress progress("splat", count_);
    std::uint32_t drawn = 0;
    const auto advance = [&](std::uint32_t soFar) {
      progress.advance(soFar - drawn);
      drawn = soFar;
    };
    Image image = fast(set_, surfaces, layers) ? drawFast(layers.depth, advance) : drawFull(surfaces, layers, advance);
    stats_.seconds["splat"] += timer.lap();
    return image;
  }

  void relight(std::vector<layout::SplatParticle> particles, bool emission) override {
    set_.particles = std::move(particles);
    if (particles_.size() > 0) device_.upload<layout::SplatParticle>(particles_, set_.particles);
    if (!emission) set_.emission.clear();
    if (full_) full_->drawEmission(emission);
  }

  const SplatSet& set() const override { return set_; }

  const std::vector<layout::uint>& order() const override {
    if (order_.empty()) order_ = device_.download<layout::uint>(indices_, count_);
    return order_;
  }

 private:
  void holds(std::uint64_t bytes) { stats_.deviceBytes = std::max(stats_.deviceBytes, bytes); }

  Image drawFast(bool withDepth, const std::function<void(std::uint32_t)>& advance) {
    const layout::SplatCamera& camera = set_.camera();
    const SplatPass pass(device_, camera.falloff, withDepth);
    const SplatTarget target = pass.createTarget(static_cast<std::uint32_t>(camera.imageSize.x),
                                                 static_cast<std::uint32_t>(camera.imageSize.y));
    TimestampQueries queries = device_.createTimestampQueries(pass.submissions(count_));
    pass.draw(target, particles_, indices_, count_, camera, &queries, advance);
    for (const StageTime& time : queries.results()) stats_.deviceSeconds[time.stage] += time.seconds;
    return pass.download(target);
  }

  Image drawFull(std::span<const float> surfaces, SplatLayers layers,
                 const std::function<void(std::uint32_t)>& advance) {
    if (!full_) full_ = std::make_unique<FullSplatPass>(device_, set_, particles_);
    const double before = full_->deviceSeconds();
    Image image = full_->draw(indices_, count_, surfaces, layers, advance);
    stats_.deviceSeconds["splat"] += full_->deviceSeconds() - before;
    holds(particles_.size() + full_->deviceBytes());
    return image;
  }

  const Device& device_;
  SplatSet set_;
  FrameStats& stats_;
  std::uint32_t count_;
  Buffer particles_, indices_;
  std::unique_ptr<FullSplatPass> full_;
  mutable std::vector<layout::uint> order_;
};

}  // namespace

std::unique_ptr<Rasterizer> hostRasterizer(SplatSet set, float keyScale, FrameStats& stats) {
  return std::make_unique<HostRasterizer>(std::move(set), keyScale, stats);
}

std::unique_ptr<Rasterizer> deviceRasterizer(const Device& device, SplatSet set, float keyScale, FrameStats& stats) {
  return std::make_unique<DeviceRasterizer>(device, std::move(set), keyScale, stats);
}

}  // namespace mote
