// What the receivers of a light grid's tile read.
#include <algorithm>

#include "host/lighting/grid_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid_read_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include "host/lighting/grid_vectors-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {

void read(const GridTile& tile, float* depths) {
  const GridPoints& points = tile.receiverPoints();
  const std::size_t count = tile.receivers;
  const auto lastCell = static_cast<float>(tile.shape->tileCells - 1);
  const IntVec run = hn::Set(kIntTag, tile.run), stride = hn::Set(kIntTag, tile.stride),
               margin = hn::Set(kIntTag, kNodeMargin);
  const int row = tile.run * tile.stride;
  for (std::size_t k = 0; k < count; k += kLanes) {
    const IntVec bin = hn::LoadU(kIntTag, &points.bin[k]);
    alignas(64) std::int32_t place[kLanes] = {};
    const std::size_t own = std::min(kLanes, count - k);
    for (std::size_t lane = 0; lane < own; ++lane) place[lane] = tile.placeOfGroup(points.bin[k + lane] >> 2);
    const IntVec inRun = hn::Add(hn::LoadU(kIntTag, place), hn::And(bin, hn::Set(kIntTag, kGroupBins - 1)));
    const Vec x = load(&points.x[k]), y = load(&points.y[k]);
    const Vec fx = hn::Min(hn::Max(hn::Floor(x), hn::Zero(kTag)), set(lastCell)),
              fy = hn::Min(hn::Max(hn::Floor(y), hn::Zero(kTag)), set(lastCell));
    const Vec wx = hn::Sub(x, fx), wy = hn::Sub(y, fy), wd = hn::Sub(load(&points.depth[k]), hn::ConvertTo(kTag, bin));
    const IntVec node = hn::Add(hn::Mul(hn::Add(hn::ConvertTo(kIntTag, fy), margin), stride),
                                hn::Add(hn::ConvertTo(kIntTag, fx), margin));
    IntVec at = hn::Add(hn::Mul(node, run), inRun);
    if (own < kLanes) at = hn::IfThenElse(hn::FirstN(kIntTag, own), at, hn::Set(kIntTag, 1));
    for (std::size_t channel = 0; channel < tile.channels; ++channel) {
      const float* nodes = tile.nodes[channel].data();
      const auto across = [&](const float* from) {
        const auto gather = [&](int offset) { return hn::GatherIndex(kTag, from + offset, at); };
        return between(between(gather(0), gather(tile.run), wx), between(gather(row), gather(row + tile.run), wx), wy);
      };
      const Vec before = across(nodes - 1), after = across(nodes);
      const Vec depth = between(before, after, wd);
      alignas(64) float out[kLanes];
      hn::Store(depth, kTag, out);
      std::copy_n(out, own, depths + channel * count + k);
    }
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(read);

void readTile(const GridTile& tile, std::vector<float>& depths) {
  depths.resize(tile.channels * tile.receivers);
  HWY_DYNAMIC_DISPATCH(read)(tile, depths.data());
}

}  // namespace mote
#endif
