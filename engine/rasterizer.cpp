#include "engine/rasterizer.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/passes/depth_key_pass.h"
#include "engine/passes/depth_order.h"
#include "engine/passes/full_splat_pass.h"
#include "engine/passes/part_size.h"
#include "engine/passes/sort_pass.h"
#include "engine/passes/splat_pass.h"
#include "engine/vulkan/barrier.h"
#include "host/core/log.h"
#include "host/core/progress.h"
#include "host/core/timer.h"
#include "host/splat/rasterize_full.h"
#include "host/splat/small_splats.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

/// True where the fast way draws all that is asked for.
bool fast(const SplatSet& set, std::span<const float> surfaces, SplatLayers layers) {
  return set.plain() && surfaces.empty() && !layers.opticalDepth && !layers.velocity && !layers.colorAlpha;
}

class HostRasterizer : public Rasterizer {
 public:
  HostRasterizer(SplatSet& set, float keyScale, FrameStats& stats) : set_(set), stats_(stats) {
    Timer timer;
    const Progress progress("sort");
    order_ = sortByDepth(set_.particles, set_.camera(), keyScale);
    stats_.seconds["sort"] += timer.lap();
  }

  Image draw(std::span<const float> surfaces, SplatLayers layers) override {
    Timer timer;
    Progress progress("splat", static_cast<double>(order_.size()), "particles");
    const auto done = [&progress](double splats) { progress.advance(splats); };
    Image image = fast(set_, surfaces, layers) ? rasterize(set_.particles, order_, set_.camera(), layers.depth, done)
                                               : rasterizeFull(set_, order_, surfaces, layers, done);
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
  SplatSet& set_;
  FrameStats& stats_;
  std::vector<layout::uint> order_;
};

/// Where particles, pairs and order fit on the device at once, all of it is done and kept there. Else runs are sorted
/// there, and every picture is drawn in parts from back to front: the same order, and the same blending.
class DeviceRasterizer : public Rasterizer {
 public:
  DeviceRasterizer(const Device& device, SplatSet& set, float keyScale, FrameStats& stats)
      : device_(device),
        set_(set),
        stats_(stats),
        keyScale_(keyScale),
        count_(static_cast<std::uint32_t>(set_.particles.size())) {
    Timer timer;
    const Progress progress("sort");
    std::vector<std::uint64_t> sizes = drawnSizes(count_);
    sizes.push_back(SortPass::pairBytes(count_));
    if (count_ <= SortPass::kMaxCount && arraysFit(device, sizes, device.stagingCost()))
      sortAtOnce(keyScale);
    else
      order_ = depthOrderInRuns(device, set_.particles, set_.camera(), keyScale, stats_.deviceSeconds["sort"]);
    stats_.seconds["sort"] += timer.lap();
  }

  Image draw(std::span<const float> surfaces, SplatLayers layers) override {
    Timer timer;
    Progress progress("splat", count_, "particles");
    Image image =
        fast(set_, surfaces, layers) ? drawFast(layers.depth, progress) : drawFull(surfaces, layers, progress);
    stats_.seconds["splat"] += timer.lap();
    return image;
  }

  void relight(std::vector<layout::SplatParticle> particles, bool emission) override {
    set_.particles = std::move(particles);
    if (!emission) set_.emission.clear();
    if (!resident_) return;
    device_.upload<layout::SplatParticle>(resident_->splats.particles, set_.particles);
    if (!emission) resident_->splats.emission = {};
  }

  const SplatSet& set() const override { return set_; }

  const std::vector<layout::uint>& order() const override {
    if (order_.empty() && resident_) order_ = device_.download<layout::uint>(resident_->indices, count_);
    return order_;
  }

 private:
  /// The particles, or a part of them, and the order in which they are drawn.
  struct Drawn {
    SplatBuffers splats;
    Buffer indices;
  };
  std::vector<std::uint64_t> drawnSizes(std::uint64_t count) const {
    std::vector<std::uint64_t> sizes = SplatBuffers::sizes(set_, count);
    sizes.push_back(count * sizeof(layout::uint));
    return sizes;
  }
  Drawn createDrawn(std::uint64_t count) const {
    return {SplatBuffers(device_, set_, count), device_.createBuffer(count * sizeof(layout::uint))};
  }

  void sortAtOnce(float keyScale) {
    resident_ = createDrawn(count_);
    const Buffer& particles = resident_->splats.particles;
    resident_->splats.upload(device_, set_);
    const Buffer pairs = device_.createBuffer(SortPass::pairBytes(count_));
    const DepthKeyPass keys(device_);
    const SortPass sort(device_);
    TimestampQueries queries = device_.createTimestampQueries(1);
    device_.run([&](CommandBuffer& commands) {
      const std::uint32_t span = queries.begin(commands, "sort");
      keys.record(commands, particles, count_, set_.camera().position, keyScale, pairs, viewAxis(set_.camera()));
      sort.record(commands, pairs, count_);
      sort.recordExtract(commands, pairs, count_, resident_->indices);
      queries.end(commands, span);
      commands.barrier(barrier::computeToIndexAndVertexInput);
    });
    addTimes(queries);
  }

  void addTimes(const TimestampQueries& queries) {
    for (const StageTime& time : queries.results()) stats_.deviceSeconds[time.stage] += time.seconds;
  }

  /// Takes the particles from the device where they leave less than `bytes` for a drawing.
  void makeRoom(std::uint64_t bytes) {
    if (!resident_ || bytes <= device_.budget().room()) return;
    order();
    resident_.reset();
  }

  /// draw(part, count, advance) for all particles from back to front: at once where they are on the device, else in
  /// parts that leave `reserved` bytes of its budget.
  template <class Draw>
  void drawInParts(std::uint64_t reserved, Progress& progress, const Draw& draw) {
    if (resident_) {
      std::uint32_t drawn = 0;
      draw(*resident_, count_, [&](std::uint32_t soFar) { progress.advance(soFar - std::exchange(drawn, soFar)); });
      return;
    }
    const auto most = static_cast<std::uint32_t>(partThatFits(
        device_, count_, kLeastPart, [&](std::uint64_t count) { return drawnSizes(count); },
        std::max(reserved, device_.stagingCost()), "the splats"));
    const Drawn part = createDrawn(most);
    std::vector<layout::uint> sequence(most);
    std::iota(sequence.begin(), sequence.end(), 0u);
    device_.upload<layout::uint>(part.indices, sequence);
    std::uint32_t first = 0, parts = 0;
    do {  // at least once: without particles the picture must still be cleared
      const std::uint32_t count = std::min(most, count_ - first);
      part.splats.upload(device_, set_, std::span(order_).subspan(first, count));
      draw(part, count, {});
      progress.advance(count);
      first += count, ++parts;
    } while (first < count_);
    logVerbose(fmt::format("splats: {} parts of at most {} particles", parts, most));
  }

  Image drawFast(bool withDepth, Progress& progress) {
    const layout::SplatCamera& camera = set_.camera();
    const auto width = static_cast<std::uint32_t>(camera.imageSize.x),
               height = static_cast<std::uint32_t>(camera.imageSize.y);
    const SplatPass pass(device_, camera.falloff, withDepth);
    makeRoom(pass.drawingCost(width, height));
    const SplatTarget target = pass.createTarget(width, height);
    if (!small_) small_ = smallSplatsFirst(set_.particles, camera, keyScale_, SplatPass::smallSide(device_));
    bool keep = false;
    std::uint32_t drawn = 0;
    drawInParts(pass.downloadCost(width, height), progress,
                [&](const Drawn& part, std::uint32_t count, const std::function<void(std::uint32_t)>& advance) {
                  TimestampQueries queries = device_.createTimestampQueries(pass.submissions(count));
                  const std::uint32_t small = std::clamp(*small_, drawn, drawn + count) - drawn;
                  pass.draw(target, part.splats.particles, part.indices, count, camera, &queries, advance, keep, small);
                  keep = true;
                  drawn += count;
                  addTimes(queries);
                });
    return pass.download(target);
  }

  Image drawFull(std::span<const float> surfaces, SplatLayers layers, Progress& progress) {
    if (!full_) {
      makeRoom(FullSplatPass::ownCost(device_, set_));
      full_ = std::make_unique<FullSplatPass>(device_, set_);
    }
    const double before = full_->deviceSeconds();
    makeRoom(full_->drawingCost(!surfaces.empty(), layers));
    full_->begin(surfaces, layers);
    drawInParts(full_->downloadCost(), progress,
                [&](const Drawn& part, std::uint32_t count, const std::function<void(std::uint32_t)>& advance) {
                  full_->draw(part.splats, part.indices, count, advance);
                });
    Image image = full_->finish();
    stats_.deviceSeconds["splat"] += full_->deviceSeconds() - before;
    return image;
  }

  const Device& device_;
  SplatSet& set_;
  FrameStats& stats_;
  float keyScale_;
  std::uint32_t count_;
  std::optional<std::uint32_t> small_;       // of the order's first, known when they are drawn the fast way
  std::optional<Drawn> resident_;            // all of them, in the set's order; empty: drawn in parts
  mutable std::vector<layout::uint> order_;  // empty while it is only on the device
  std::unique_ptr<FullSplatPass> full_;
};

}  // namespace

std::unique_ptr<Rasterizer> hostRasterizer(SplatSet& set, float keyScale, FrameStats& stats) {
  return std::make_unique<HostRasterizer>(set, keyScale, stats);
}

std::unique_ptr<Rasterizer> deviceRasterizer(const Device& device, SplatSet& set, float keyScale, FrameStats& stats) {
  return std::make_unique<DeviceRasterizer>(device, set, keyScale, stats);
}

}  // namespace mote
