#include "engine/passes/light_grid_pass.h"

#include <algorithm>

#include "host/core/parallel.h"
#include "host/lighting/grid/near_light.h"

namespace mote {
namespace {

/// Particles and receivers of the tiles that are set up together: of so many that all threads are busy to the end.
constexpr std::size_t kMostItems = std::size_t{1} << 20;

}  // namespace

/// What the tiles of one call share, and where their depths go.
struct LightGridPass::Call {
  const Octree& tree;
  const Receivers& receivers;
  const LightingOptions& options;
  const GridShape& shape;
  const GridPlan& plan;
  float slack;  // columnRules
  const RaysDone& done;
  std::vector<float> depths;  // [channel][receiver]

  std::size_t items(const GridPlan::Tile& tile) const {
    return plan.receivers(tile).size() + plan.particles(tile).size();
  }
};

std::span<const LightGridPass::Work> LightGridPass::setUpTiles(const Call& call, std::size_t begin) {
  const std::vector<GridPlan::Tile>& tiles = call.plan.tiles;
  std::size_t end = begin, items = 0;
  while (end < tiles.size() && (end == begin || items + call.items(tiles[end]) <= kMostItems))
    items += call.items(tiles[end++]);
  if (works_.size() < end - begin) works_.resize(end - begin);
  parallelBlocks(end - begin, 1, [&](std::size_t k, std::size_t) {
    auto& [tile, blocks, read] = workspaces_.local();
    Work& work = works_[k];
    work.planned = &tiles[begin + k];
    tile.setUp(call.tree, call.receivers, call.plan, *work.planned, call.shape, call.options.falloff);
    blocks.setUp(tile, call.receivers, call.plan.receivers(*work.planned), call.plan.particles(*work.planned),
                 work.arrays);
  });
  return std::span(works_).first(end - begin);
}

void LightGridPass::release() {
  grid_.release();
  works_ = {};
  workspaces_.clear();
}

void LightGridPass::keep(Call& call, std::span<const Work> works, std::span<const float> found) {
  const std::size_t channels = call.tree.channels(), all = found.size() / channels;
  std::vector<std::size_t> start(works.size(), 0);
  for (std::size_t w = 1; w < works.size(); ++w) start[w] = start[w - 1] + works[w - 1].arrays.receivers.size();
  parallelBlocks(works.size(), 1, [&](std::size_t w, std::size_t) {
    std::vector<float>& read = workspaces_.local().read;
    const GridPlan::Tile& planned = *works[w].planned;
    const std::span<const std::uint32_t> members = call.plan.receivers(planned);
    const std::size_t count = members.size();
    read.clear();
    for (std::size_t c = 0; c < channels; ++c) {
      const std::span<const float> one = found.subspan(c * all + start[w], count);
      read.insert(read.end(), one.begin(), one.end());
    }
    addNearLight(call.tree, call.plan.nearLight, call.shape, planned.place, call.receivers, members, call.options,
                 call.slack, read);
    for (std::size_t c = 0; c < channels; ++c)
      for (std::size_t i = 0; i < count; ++i) call.depths[c * call.receivers.size() + members[i]] = read[c * count + i];
  });
  if (call.done) call.done(all);
}

std::vector<float> LightGridPass::opticalDepths(const Octree& tree, const Receivers& receivers,
                                                const layout::Light& light, const LightingOptions& options,
                                                const GridResolution& resolution, std::span<const std::uint8_t> reached,
                                                const RaysDone& done) {
  MOTE_CHECK(resolution.cell, >, 0.0);
  MOTE_CHECK(resolution.bin, >, 0.0);
  const std::size_t channels = tree.channels();
  std::vector<float> depths(channels * receivers.size(), 0.0f);
  if (shadowless(light) || tree.particleCount() == 0) return depths;
  const GridShape shape = gridShape(light, resolution, options.falloff);
  const GridPlan plan = planGrid(tree, receivers, shape, reached);
  const float slack = columnRules(tree, light, receivers.bounds()).slack;
  const GridDevice::Manner manner{options.falloff, channels > 1, channels, shape.perspective() ? resolution.cell : 0};
  Call call{tree, receivers, options, shape, plan, slack, done, std::move(depths)};
  for (std::size_t begin = 0; begin < plan.tiles.size();) {
    std::span<const Work> works = setUpTiles(call, begin);
    begin += works.size();
    std::vector<const GridArrays*> arrays;
    for (const Work& work : works) arrays.push_back(&work.arrays);
    std::span<const GridArrays* const> tiles = arrays;
    while (!works.empty()) {
      const std::size_t batch = grid_.batchThatFits(tiles, manner), count = std::max<std::size_t>(batch, 1);
      keep(call, works.first(count),
           batch > 0 ? grid_.run(tiles.first(batch), manner) : grid_.runInParts(*tiles.front(), manner));
      works = works.subspan(count), tiles = tiles.subspan(count);
    }
  }
  return std::move(call.depths);
}

}  // namespace mote
