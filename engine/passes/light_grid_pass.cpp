#include "engine/passes/light_grid_pass.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>

#include "engine/passes/part_size.h"
#include "host/core/parallel.h"
#include "host/lighting/grid_near_light.h"
#include "spirv.h"

namespace mote {
namespace {

/// Particles and receivers of the tiles that are set up together: of so many that all threads are busy to the end.
constexpr std::size_t kMostItems = std::size_t{1} << 20;
/// Of all arrays of a batch.
constexpr std::uint64_t kBatchBytes = std::uint64_t{64} << 20;
/// Of a shader's loops: lavapipe ends them after 65535 altogether.
constexpr std::uint32_t kMostSteps = 60000;

/// A buffer's elements to be filled: where it is mapped they are the buffer's own, else they are copied at the end.
template <class T>
class Filling {
 public:
  Filling(const Device& device, const Buffer& to, std::uint64_t bytes) : device_(device), to_(to) {
    if (!to.mapped()) own_.resize(bytes / sizeof(T));
    elements = to.mapped() ? to.map<T>().first(bytes / sizeof(T)) : std::span<T>(own_);
  }
  Filling(const Filling&) = delete;
  void finish() const {
    if (!to_.mapped()) device_.upload<T>(to_, own_);
  }
  std::span<T> elements;

 private:
  const Device& device_;
  const Buffer& to_;
  std::vector<T> own_;
};

}  // namespace

/// What the tiles of one call share, and where their depths go.
struct LightGridPass::Call {
  /// Of each thread, and gone with the call: hundreds of bytes for each particle of a tile.
  struct Workspace {
    GridTile tile;
    GridBlocks blocks;
    std::vector<float> read;
  };

  const Octree& tree;
  const Receivers& receivers;
  const LightingOptions& options;
  const GridShape& shape;
  const GridPlan& plan;
  float slack;  // columnRules
  const RaysDone& done;
  std::vector<float> depths;  // [channel][receiver]
  std::vector<Work> works{};  // of tiles that are set up together; their memory serves the next ones
  tbb::enumerable_thread_specific<Workspace> workspaces{};

  std::size_t items(const GridPlan::Tile& tile) const {
    return plan.receivers(tile).size() + plan.particles(tile).size();
  }
};

LightGridPass::LightGridPass(const Device& device)
    : device_(device),
      queries_(device.createTimestampQueries(1)),
      groupSize_(device.isCpu() ? device.subgroupSize() : std::max(64u, device.mostSubgroupSize())),
      storeLanes_(std::min(8u, device.leastSubgroupSize())) {}

const ComputePipeline& LightGridPass::fill(const FillVariant& variant) {
  ComputePipeline& made = fills_[variant];
  if (made.handle() != VK_NULL_HANDLE) return made;
  const auto has = [&](std::uint32_t kind) { return std::uint32_t{(variant.kinds & kind) != 0}; };
  made = device_.createComputePipeline(spirv::grid_fill_comp, sizeof(layout::GridParams),
                                       std::array<SpecializationConstant, 8>{{{0, groupSize_},
                                                                              {1, variant.falloff},
                                                                              {2, has(kTentKernels)},
                                                                              {3, has(kEllipseKernels)},
                                                                              {4, has(kCurvedKernels)},
                                                                              {5, variant.goesOn},
                                                                              {6, storeLanes_},
                                                                              {7, variant.colours}}});
  return made;
}

LightGridPass::Sizes LightGridPass::sum(const Sizes& a, const Sizes& b) {
  Sizes all{};
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = a[k] + b[k];
  return all;
}

LightGridPass::Sizes LightGridPass::sizesOf(const GridArrays& a, std::size_t channels) {
  constexpr std::uint64_t kFloat = sizeof(float), kUint = sizeof(layout::uint);
  const std::uint64_t kernels = a.kernels.size(), receivers = a.receivers.size();
  return {kernels * sizeof(layout::GridKernel),
          channels > 1 ? channels * kernels * kFloat : 0,
          a.entries.size() * kUint,
          a.blocks.size() * sizeof(layout::GridBlock),
          a.strands() * sizeof(layout::GridStrand),
          std::uint64_t{a.storedBlocks} * layout::kBlockPairs * sizeof(layout::GridPair),
          a.table.size() * sizeof(layout::GridEntryPair),
          receivers * sizeof(layout::GridReceiver),
          channels * receivers * kFloat};
}

bool LightGridPass::fits(const Sizes& sizes) {
  const auto held = buffers_.all();
  std::uint64_t own = 0, bytes = 0;
  for (std::size_t k = 0; k < sizes.size(); ++k) own += device_.bufferCost(held[k]->size()), bytes += sizes[k];
  if (bytes > kBatchBytes) return false;
  return arraysCost(device_, {sizes.begin(), sizes.end()}) + device_.stagingCost() <= device_.budget().room() + own;
}

void LightGridPass::makeRoom(const Sizes& sizes) {
  const auto buffers = buffers_.all();
  bool enough = true;
  Sizes room{};
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    enough = enough && sizes[k] <= buffers[k]->size();
    room[k] = std::max<std::uint64_t>(buffers[k]->size(), sizes[k] + sizes[k] / 8);
  }
  if (enough) return;
  buffers_ = {};
  // More where that fits: batches differ, and so few of them make the buffers anew.
  if (!arraysFit(device_, {room.begin(), room.end()}, device_.stagingCost())) room = sizes;
  for (std::size_t k = 0; k < sizes.size(); ++k) *buffers[k] = device_.createBuffer(room[k]);
  device_.upload<layout::GridPair>(buffers_.stored, std::vector<layout::GridPair>(layout::kBlockPairs));
}

std::vector<GridArrays::Pieces> LightGridPass::upload(std::span<const Work> works, const Sizes& sizes,
                                                      std::size_t channels) {
  std::vector<const GridArrays*> tiles;
  for (const Work& work : works) tiles.push_back(&work.arrays);
  const Buffers& to = buffers_;
  const Filling<layout::GridKernel> kernels(device_, to.kernels, sizes[0]);
  const Filling<float> peaks(device_, to.peaks, sizes[1]);
  const Filling<std::uint32_t> entries(device_, to.entries, sizes[2]);
  const Filling<layout::GridBlock> blocks(device_, to.blocks, sizes[3]);
  const Filling<layout::GridEntryPair> table(device_, to.table, sizes[6]);
  const Filling<layout::GridReceiver> receivers(device_, to.receivers, sizes[7]);
  const Filling<float> own(device_, to.depths, sizes[8]);
  join(tiles, channels,
       {kernels.elements, peaks.elements, entries.elements, blocks.elements, table.elements, receivers.elements,
        own.elements});
  kernels.finish(), peaks.finish(), entries.finish(), blocks.finish(), table.finish(), receivers.finish(), own.finish();
  std::vector<GridArrays::Pieces> all = joinPieces(tiles);
  std::size_t strands = 0;
  for (const GridArrays::Pieces& pieces : all) {
    device_.upload<layout::GridStrand>(to.strands, pieces.strands, strands);
    strands += pieces.strands.size();
  }
  return all;
}

layout::GridParams LightGridPass::params(double cell) const {
  const Buffers& from = buffers_;
  layout::GridParams params{};
  params.kernels = from.kernels.address(), params.peaks = from.peaks.address();
  params.entries = from.entries.address(), params.blocks = from.blocks.address();
  params.stored = from.stored.address(), params.table = from.table.address();
  params.receivers = from.receivers.address(), params.depths = from.depths.address();
  params.cell = static_cast<float>(cell);
  return params;
}

void LightGridPass::fillNodes(CommandBuffer& commands, std::span<const GridArrays::Pieces> all,
                              layout::GridParams params, layout::uint falloff, bool colours) {
  const std::size_t eachGroup = groupSize_ / device_.mostSubgroupSize();
  params.strands = buffers_.strands.address();
  std::uint32_t round = 0;
  for (const GridArrays::Pieces& pieces : all) {
    if (pieces.round != round) commands.barrier(barrier::computeToCompute);
    round = pieces.round;
    params.count = static_cast<layout::uint>(pieces.strands.size());
    commands.dispatchRow(fill({falloff, pieces.kinds, round > 0, colours}), params,
                         (pieces.strands.size() + eachGroup - 1) / eachGroup);
    params.strands += pieces.strands.size() * sizeof(layout::GridStrand);
  }
}

std::vector<float> LightGridPass::run(std::span<const Work> works, std::size_t channels, layout::uint falloff,
                                      double cell) {
  Sizes sizes = kNoTiles;
  for (const Work& work : works) sizes = sum(sizes, sizesOf(work.arrays, channels));
  makeRoom(sizes);
  const std::vector<GridArrays::Pieces> pieces = upload(works, sizes, channels);
  if (read_.handle() == VK_NULL_HANDLE)
    read_ = device_.createComputePipeline(spirv::grid_read_comp, sizeof(layout::GridParams),
                                          std::array<SpecializationConstant, 1>{{{0, groupSize_}}});
  const std::size_t kernels = sizes[0] / sizeof(layout::GridKernel);
  const std::size_t receivers = sizes[7] / sizeof(layout::GridReceiver);
  layout::GridParams of = params(cell);
  queries_.reset();
  device_.run([&](CommandBuffer& commands) {
    const std::uint32_t stage = queries_.begin(commands, "light grid");
    for (std::size_t channel = 0; channel < channels; ++channel) {
      fillNodes(commands, pieces, of, falloff, channels > 1);
      commands.barrier(barrier::computeToCompute);
      of.count = static_cast<layout::uint>(receivers);
      commands.dispatchRow(read_, of, (receivers + groupSize_ - 1) / groupSize_);
      commands.barrier(barrier::computeToCompute);  // the next channel takes the same nodes
      of.peaks += kernels * sizeof(float), of.depths += receivers * sizeof(float);
    }
    queries_.end(commands, stage);
  });
  for (const StageTime& stage : queries_.results()) deviceSeconds_ += stage.seconds;
  return device_.download<float>(buffers_.depths, channels * receivers);
}

std::span<const LightGridPass::Work> LightGridPass::setUpTiles(Call& call, std::size_t begin) const {
  const std::vector<GridPlan::Tile>& tiles = call.plan.tiles;
  std::size_t end = begin, items = 0;
  while (end < tiles.size() && (end == begin || items + call.items(tiles[end]) <= kMostItems))
    items += call.items(tiles[end++]);
  if (call.works.size() < end - begin) call.works.resize(end - begin);
  parallelBlocks(end - begin, 1, [&](std::size_t k, std::size_t) {
    auto& [tile, blocks, read] = call.workspaces.local();
    Work& work = call.works[k];
    work.planned = &tiles[begin + k];
    tile.setUp(call.tree, call.receivers, call.plan, *work.planned, call.shape, call.options.falloff);
    blocks.setUp(tile, call.receivers, call.plan.receivers(*work.planned), call.plan.particles(*work.planned),
                 device_.leastSubgroupSize(), kMostSteps, work.arrays);
  });
  return std::span(call.works).first(end - begin);
}

std::size_t LightGridPass::batchThatFits(std::span<const Work> works, std::size_t channels) {
  Sizes sizes = sum(kNoTiles, sizesOf(works.front().arrays, channels));
  std::size_t count = 1;
  for (; count < works.size(); ++count) {
    sizes = sum(sizes, sizesOf(works[count].arrays, channels));
    if (!fits(sizes)) break;
  }
  return count;
}

void LightGridPass::keep(Call& call, std::span<const Work> works, std::span<const float> found) {
  const std::size_t channels = call.tree.channels(), all = found.size() / channels;
  std::vector<std::size_t> start(works.size(), 0);
  for (std::size_t w = 1; w < works.size(); ++w) start[w] = start[w - 1] + works[w - 1].arrays.receivers.size();
  parallelBlocks(works.size(), 1, [&](std::size_t w, std::size_t) {
    std::vector<float>& read = call.workspaces.local().read;
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
  Call call{tree, receivers, options, shape, plan, slack, done, std::move(depths)};
  for (std::size_t begin = 0; begin < plan.tiles.size();) {
    std::span<const Work> works = setUpTiles(call, begin);
    begin += works.size();
    while (!works.empty()) {
      const std::span<const Work> batch = works.first(batchThatFits(works, channels));
      keep(call, batch, run(batch, channels, options.falloff, resolution.cell));
      works = works.subspan(batch.size());
    }
  }
  return std::move(call.depths);
}

}  // namespace mote
