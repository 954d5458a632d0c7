#include "engine/passes/light_grid_pass.h"

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

std::vector<float> LightGridPass::run(std::span<const GridArrays* const> tiles, std::size_t channels,
                                      layout::uint falloff, double cell) {
  Sizes sizes = kNoTiles;
  for (const GridArrays* tile : tiles) sizes = sum(sizes, sizesOf(*tile, channels));
  makeRoom(sizes);
  const Buffers& to = buffers_;
  const std::size_t kernels = sizes[0] / sizeof(layout::GridKernel);
  const std::size_t receivers = sizes[7] / sizeof(layout::GridReceiver);
  const Filling<layout::GridKernel> kernel(device_, to.kernels, sizes[0]);
  const Filling<float> peaks(device_, to.peaks, sizes[1]);
  const Filling<std::uint32_t> entries(device_, to.entries, sizes[2]);
  const Filling<layout::GridBlock> blocks(device_, to.blocks, sizes[3]);
  const Filling<layout::GridEntryPair> table(device_, to.table, sizes[6]);
  const Filling<layout::GridReceiver> receiver(device_, to.receivers, sizes[7]);
  const Filling<float> own(device_, to.depths, sizes[8]);
  join(tiles, channels,
       {kernel.elements, peaks.elements, entries.elements, blocks.elements, table.elements, receiver.elements,
        own.elements});
  kernel.finish(), peaks.finish(), entries.finish(), blocks.finish(), table.finish(), receiver.finish(), own.finish();
  const std::vector<GridArrays::Pieces> all = joinPieces(tiles);
  std::size_t strands = 0;
  for (const GridArrays::Pieces& pieces : all) {
    device_.upload<layout::GridStrand>(to.strands, pieces.strands, strands);
    strands += pieces.strands.size();
  }
  layout::GridParams params{};
  params.kernels = to.kernels.address(), params.peaks = to.peaks.address();
  params.entries = to.entries.address(), params.blocks = to.blocks.address();
  params.stored = to.stored.address(), params.table = to.table.address();
  params.receivers = to.receivers.address(), params.depths = to.depths.address();
  params.cell = static_cast<float>(cell);
  if (read_.handle() == VK_NULL_HANDLE)
    read_ = device_.createComputePipeline(spirv::grid_read_comp, sizeof(layout::GridParams),
                                          std::array<SpecializationConstant, 1>{{{0, groupSize_}}});
  const std::size_t eachGroup = groupSize_ / device_.mostSubgroupSize();
  queries_.reset();
  device_.run([&](CommandBuffer& commands) {
    const std::uint32_t stage = queries_.begin(commands, "light grid");
    for (std::size_t channel = 0; channel < channels; ++channel) {
      std::uint64_t strand = to.strands.address();
      std::uint32_t round = 0;
      for (const GridArrays::Pieces& pieces : all) {
        if (pieces.round != round) commands.barrier(barrier::computeToCompute);
        round = pieces.round;
        params.strands = strand, params.count = static_cast<layout::uint>(pieces.strands.size());
        strand += pieces.strands.size() * sizeof(layout::GridStrand);
        commands.dispatchRow(fill({falloff, pieces.kinds, round > 0, channels > 1}), params,
                             (pieces.strands.size() + eachGroup - 1) / eachGroup);
      }
      commands.barrier(barrier::computeToCompute);
      params.count = static_cast<layout::uint>(receivers);
      commands.dispatchRow(read_, params, (receivers + groupSize_ - 1) / groupSize_);
      commands.barrier(barrier::computeToCompute);  // the next channel takes the same nodes
      params.peaks += kernels * sizeof(float), params.depths += receivers * sizeof(float);
    }
    queries_.end(commands, stage);
  });
  for (const StageTime& stage : queries_.results()) deviceSeconds_ += stage.seconds;
  return device_.download<float>(to.depths, channels * receivers);
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
  const auto itemsOf = [&](const GridPlan::Tile& tile) {
    return plan.receivers(tile).size() + plan.particles(tile).size();
  };
  // A batch's depths to the receivers they belong to.
  const auto finish = [&](std::size_t first, std::size_t last) {
    std::vector<const GridArrays*> parts;
    for (std::size_t w = first; w < last; ++w) parts.push_back(&works_[w].arrays);
    const std::vector<float> found = run(parts, channels, options.falloff, resolution.cell);
    const std::size_t all = found.size() / channels;
    std::vector<std::size_t> start(last - first + 1, 0);
    for (std::size_t w = first; w < last; ++w)
      start[w - first + 1] = start[w - first] + works_[w].arrays.receivers.size();
    parallelBlocks(last - first, 1, [&](std::size_t k, std::size_t) {
      static thread_local std::vector<float> read;
      const Work& work = works_[first + k];
      const std::span<const std::uint32_t> members = plan.receivers(*work.planned);
      const std::size_t count = members.size();
      read.resize(channels * count);
      for (std::size_t c = 0; c < channels; ++c)
        std::copy_n(found.begin() + static_cast<std::ptrdiff_t>(c * all + start[k]), count,
                    read.begin() + static_cast<std::ptrdiff_t>(c * count));
      addNearLight(tree, plan.nearLight, shape, work.planned->place, receivers, members, options, slack, read);
      for (std::size_t c = 0; c < channels; ++c)
        for (std::size_t i = 0; i < count; ++i) depths[c * receivers.size() + members[i]] = read[c * count + i];
    });
    if (done) done(all);
  };
  for (std::size_t begin = 0, end = 0; begin < plan.tiles.size(); begin = end) {
    std::size_t items = 0;
    while (end < plan.tiles.size() && (end == begin || items + itemsOf(plan.tiles[end]) <= kMostItems))
      items += itemsOf(plan.tiles[end++]);
    if (works_.size() < end - begin) works_.resize(end - begin);
    parallelBlocks(end - begin, 1, [&](std::size_t k, std::size_t) {
      const GridPlan::Tile& planned = plan.tiles[begin + k];
      static thread_local GridTile tile;
      static thread_local GridBlocks blocks;
      tile.setUp(tree, receivers, plan, planned, shape, options.falloff);
      works_[k].planned = &planned;
      blocks.setUp(tile, receivers, plan.receivers(planned), plan.particles(planned), device_.leastSubgroupSize(),
                   kMostSteps, works_[k].arrays);
    });
    for (std::size_t first = 0, last = 0; first < end - begin; first = last) {
      const auto with = [&](const Sizes& sizes, std::size_t w) {
        return sum(sizes, sizesOf(works_[w].arrays, channels));
      };
      Sizes sizes = with(kNoTiles, last++);
      for (; last < end - begin && fits(with(sizes, last)); ++last) sizes = with(sizes, last);
      finish(first, last);
    }
  }
  return depths;
}

}  // namespace mote
