#include "engine/passes/grid_device.h"

#include <algorithm>
#include <numeric>

#include "engine/passes/grid_parts.h"
#include "engine/passes/part_size.h"
#include "engine/vulkan/check.h"
#include "spirv.h"

namespace mote {
namespace {

/// Of all arrays of a batch of several tiles.
constexpr std::uint64_t kBatchBytes = std::uint64_t{64} << 20;

constexpr std::uint32_t kKernelTexelBytes = 16;  // half a GridKernel
constexpr std::uint32_t kEntryTexelBytes = layout::kEntriesAtOnce * sizeof(std::uint32_t);
constexpr std::uint32_t kPairBytes = 8;  // two sums, a GridPair

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

GridDevice::GridDevice(const Device& device)
    : device_(device),
      queries_(device.createTimestampQueries(1)),
      readGroupSize_(std::max(64u, device.mostSubgroupSize())),
      groupSize_(device.isCpu() ? device.subgroupSize() : readGroupSize_) {}

const ComputePipeline& GridDevice::fill(const FillVariant& variant) {
  ComputePipeline& made = fills_[variant];
  if (made.handle() != VK_NULL_HANDLE) return made;
  const auto has = [&](std::uint32_t kind) { return std::uint32_t{(variant.kinds & kind) != 0}; };
  made = device_.createComputePipeline(spirv::grid_fill_comp, sizeof(layout::GridParams),
                                       std::array<SpecializationConstant, 7>{{{0, groupSize_},
                                                                              {1, variant.falloff},
                                                                              {2, has(kTentKernels)},
                                                                              {3, has(kEllipseKernels)},
                                                                              {4, has(kCurvedKernels)},
                                                                              {5, variant.colours},
                                                                              {6, has(kSeveralRadii)}}},
                                       2);
  return made;
}

GridDevice::Sizes GridDevice::sum(const Sizes& a, const Sizes& b) {
  Sizes all{};
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = a[k] + b[k];
  return all;
}

GridDevice::Sizes GridDevice::sizesOf(const GridCounts& counts, const Manner& manner) {
  constexpr std::uint64_t kFloat = sizeof(float), kUint = sizeof(layout::uint);
  return {counts.kernels * sizeof(layout::GridKernel),
          manner.colours ? manner.channels * counts.kernels * kFloat : 0,
          counts.entries * kUint,
          counts.works * sizeof(layout::GridWork),
          counts.works * layout::kBlockPairs * kFloat,
          counts.works * kUint,
          counts.strands * sizeof(layout::GridStrand),
          counts.stored * layout::kBlockPairs * sizeof(layout::GridPair),
          counts.table * sizeof(layout::GridPlaces),
          counts.receivers * sizeof(layout::GridReceiver),
          manner.channels * counts.receivers * kFloat};
}

GridDevice::Sizes GridDevice::noTiles() {
  Sizes sizes{};
  sizes[kStored] = layout::kBlockPairs * sizeof(layout::GridPair);
  return sizes;
}

void GridDevice::release() {
  kernelTexels_ = {}, entryTexels_ = {}, sumTexels_ = {}, storedTexels_ = {}, tableTexels_ = {}, receiverTexels_ = {};
  buffers_ = {};
}

bool GridDevice::texelsFit(const Sizes& sizes) const {
  const std::uint64_t longest =
      std::max({sizes[kKernels] / kKernelTexelBytes, sizes[kEntries] / kEntryTexelBytes, sizes[kSums] / kPairBytes,
                sizes[kStored] / kPairBytes, sizes[kTable] / sizeof(layout::GridPlaces),
                sizes[kReceivers] / sizeof(layout::GridReceiver)});
  return longest <= device_.mostTexels();
}

bool GridDevice::fits(const Sizes& sizes) {
  std::uint64_t own = 0;
  for (const Buffer* held : buffers_.all()) own += device_.bufferCost(held->size());
  if (*std::max_element(sizes.begin(), sizes.end()) > device_.maxBufferBytes() || !texelsFit(sizes)) return false;
  return arraysCost(device_, {sizes.begin(), sizes.end()}) + device_.stagingCost() <= device_.budget().room() + own;
}

void GridDevice::makeRoom(const Sizes& sizes) {
  const auto buffers = buffers_.all();
  bool enough = true;
  Sizes room{};
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    enough = enough && sizes[k] <= buffers[k]->size();
    room[k] = std::max<std::uint64_t>(buffers[k]->size(), sizes[k] + sizes[k] / 8);
  }
  if (enough) return;
  release();
  // More where that fits: batches differ, and so few of them make the buffers anew.
  if (!arraysFit(device_, {room.begin(), room.end()}, device_.stagingCost())) room = sizes;
  for (std::size_t k = 0; k < sizes.size(); ++k) *buffers[k] = device_.createBuffer(room[k]);
  kernelTexels_ = device_.createTexelView(buffers_.kernels, VK_FORMAT_R32G32B32A32_SFLOAT, kKernelTexelBytes);
  entryTexels_ = device_.createTexelView(buffers_.entries, VK_FORMAT_R32G32B32A32_UINT, kEntryTexelBytes);
  sumTexels_ = device_.createTexelView(buffers_.sums, VK_FORMAT_R32G32_SFLOAT, kPairBytes);
  storedTexels_ = device_.createTexelView(buffers_.stored, VK_FORMAT_R32G32_SFLOAT, kPairBytes);
  tableTexels_ = device_.createTexelView(buffers_.table, VK_FORMAT_R32G32B32A32_UINT, sizeof(layout::GridPlaces));
  receiverTexels_ =
      device_.createTexelView(buffers_.receivers, VK_FORMAT_R32G32B32A32_UINT, sizeof(layout::GridReceiver));
  device_.upload<layout::GridPair>(buffers_.stored, std::vector<layout::GridPair>(layout::kBlockPairs));
}

std::vector<GridWorks> GridDevice::upload(std::span<const GridArrays* const> tiles, const Sizes& sizes,
                                          std::size_t channels) {
  const Buffers& to = buffers_;
  const Filling<layout::GridKernel> kernels(device_, to.kernels, sizes[kKernels]);
  const Filling<float> peaks(device_, to.peaks, sizes[kPeaks]);
  const Filling<std::uint32_t> entries(device_, to.entries, sizes[kEntries]);
  const Filling<std::uint32_t> blocks(device_, to.blocks, sizes[kBlocks]);
  const Filling<layout::GridStrand> strands(device_, to.strands, sizes[kStrands]);
  const Filling<layout::GridPlaces> table(device_, to.table, sizes[kTable]);
  const Filling<layout::GridReceiver> receivers(device_, to.receivers, sizes[kReceivers]);
  const Filling<float> own(device_, to.depths, sizes[kDepths]);
  join(tiles, channels,
       {kernels.elements, peaks.elements, entries.elements, blocks.elements, strands.elements, table.elements,
        receivers.elements, own.elements});
  kernels.finish(), peaks.finish(), entries.finish(), blocks.finish(), strands.finish(), table.finish();
  receivers.finish(), own.finish();
  const Filling<layout::GridWork> works(device_, to.works, sizes[kWorks]);
  const std::vector<GridWorks> all = joinWorks(tiles, groupSize_, works.elements);
  works.finish();
  return all;
}

layout::GridParams GridDevice::params(double cell) const {
  const Buffers& from = buffers_;
  layout::GridParams params{};
  params.peaks = from.peaks.address(), params.works = from.works.address(), params.sums = from.sums.address();
  params.blocks = from.blocks.address(), params.strands = from.strands.address();
  params.stored = from.stored.address(), params.table = from.table.address();
  params.receivers = from.receivers.address(), params.depths = from.depths.address();
  params.cell = static_cast<float>(cell);
  return params;
}

void GridDevice::fillNodes(CommandBuffer& commands, std::span<const GridWorks> all, layout::GridParams params,
                           const Manner& manner) {
  for (const GridWorks& kind : all) {
    params.count = kind.count;
    params.works = buffers_.works.address() + kind.first * sizeof(layout::GridWork);
    const ComputePipeline& pipeline = fill({manner.falloff, kind.kinds, manner.colours});
    commands.bindTexels(pipeline, {kernelTexels_.handle(), entryTexels_.handle()});
    commands.dispatchRow(pipeline, params, (kind.count + groupSize_ - 1) / groupSize_);
  }
}

std::vector<float> GridDevice::run(std::span<const GridArrays* const> tiles, const Manner& manner) {
  Sizes sizes = noTiles();
  for (const GridArrays* tile : tiles) sizes = sum(sizes, sizesOf(tile->counts(), manner));
  makeRoom(sizes);
  const std::vector<GridWorks> works = upload(tiles, sizes, manner.channels);
  const bool begun = std::any_of(tiles.begin(), tiles.end(), [](const GridArrays* tile) { return tile->begun; });
  ComputePipeline& sum = sums_[begun];
  if (sum.handle() == VK_NULL_HANDLE)
    sum = device_.createComputePipeline(spirv::grid_sum_comp, sizeof(layout::GridParams),
                                        std::array<SpecializationConstant, 2>{{{0, groupSize_}, {1, begun}}}, 1);
  if (read_.handle() == VK_NULL_HANDLE)
    read_ = device_.createComputePipeline(spirv::grid_read_comp, sizeof(layout::GridParams),
                                          std::array<SpecializationConstant, 1>{{{0, readGroupSize_}}}, 3);
  const std::size_t kernels = sizes[kKernels] / sizeof(layout::GridKernel);
  const std::size_t receivers = sizes[kReceivers] / sizeof(layout::GridReceiver),
                    strands = sizes[kStrands] / sizeof(layout::GridStrand);
  layout::GridParams of = params(manner.cell);
  queries_.reset();
  device_.run([&](CommandBuffer& commands) {
    const std::uint32_t stage = queries_.begin(commands, "light grid");
    for (std::size_t channel = 0; channel < manner.channels; ++channel) {
      commands.barrier(barrier::computeToCompute);  // the channel, or part of a tile, before took the same nodes
      fillNodes(commands, works, of, manner);
      commands.barrier(barrier::computeToCompute);
      of.count = static_cast<layout::uint>(strands);
      const std::size_t sums = strands * layout::kBlockNodes / 2;
      if (strands > 0) {
        commands.bindTexels(sum, {sumTexels_.handle()});
        commands.dispatchRow(sum, of, (sums + groupSize_ - 1) / groupSize_);
      }
      commands.barrier(barrier::computeToCompute);
      of.count = static_cast<layout::uint>(receivers);
      commands.bindTexels(read_, {storedTexels_.handle(), tableTexels_.handle(), receiverTexels_.handle()});
      commands.dispatchRow(read_, of, (receivers + readGroupSize_ - 1) / readGroupSize_);
      of.peaks += kernels * sizeof(float), of.depths += receivers * sizeof(float);
    }
    queries_.end(commands, stage);
  });
  for (const StageTime& stage : queries_.results()) seconds_ += stage.seconds;
  return device_.download<float>(buffers_.depths, manner.channels * receivers);
}

std::size_t GridDevice::batchThatFits(std::span<const GridArrays* const> tiles, const Manner& manner) {
  Sizes sizes = noTiles();
  for (std::size_t count = 0; count < tiles.size(); ++count) {
    sizes = sum(sizes, sizesOf(tiles[count]->counts(), manner));
    const bool tooLong = count > 0 && std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{0}) > kBatchBytes;
    if (tooLong || !fits(sizes)) return count;
  }
  return tiles.size();
}

std::vector<float> GridDevice::runInParts(const GridArrays& tile, const Manner& manner) {
  constexpr std::uint64_t kShares = 1 << 12;  // so finely is chosen how much of the tile a part has
  GridParts parts(tile);
  const GridCounts all = tile.counts();
  const auto most = [&](std::uint64_t share) {
    GridCounts counts = parts.least();
    for (auto count : {&GridCounts::kernels, &GridCounts::entries, &GridCounts::works, &GridCounts::strands,
                       &GridCounts::table, &GridCounts::receivers, &GridCounts::stored})
      counts.*count += all.*count * share / kShares;
    return counts;
  };
  Manner one = manner;
  one.channels = 1;
  const auto sizes = [&](std::uint64_t share) { return sum(noTiles(), sizesOf(most(share), one)); };
  const auto arrays = [&](std::uint64_t share) {
    const Sizes of = sizes(share);
    return std::vector<std::uint64_t>(of.begin(), of.end());
  };
  release();
  std::uint64_t share = partThatFits(device_, kShares, 0, arrays, device_.stagingCost(),
                                     "particles and receivers of a tile of the light grid");
  while (share > 0 && !texelsFit(sizes(share))) share /= 2;
  if (!texelsFit(sizes(share)))
    throw DeviceError(
        DeviceFault::Refused,
        fmt::format("the least part of a light grid's tile is beyond the maxTexelBufferElements of {}, {}; "
                    "work with --lighting cpu, or with lighting.error 0",
                    device_.name(), device_.mostTexels()));
  makeRoom(sizes(share));  // for all parts: what is stored must stay
  std::vector<float> depths(manner.channels * all.receivers);
  GridArrays part;
  for (std::size_t channel = 0; channel < manner.channels; ++channel)
    for (parts.start(most(share), channel); parts.next(part);) {
      const std::vector<float> found = run(std::array<const GridArrays*, 1>{&part}, one);
      for (std::size_t k = 0; k < found.size(); ++k) depths[channel * all.receivers + parts.receivers()[k]] = found[k];
    }
  return depths;
}

}  // namespace mote
