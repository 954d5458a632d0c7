// What the receivers of a light grid read.
#include <algorithm>

#include "host/lighting/grid/field.h"
#include "host/lighting/grid/tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/lighting/grid/read_simd.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include "host/lighting/grid/vectors-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {

void read(const GridTile& tile, float* depths) {
  const GridPoints& points = tile.receiverPoints();
  const std::size_t count = tile.receivers;
  const Vec zero = hn::Zero(kTag), lastColumn = set(static_cast<float>(tile.columns - 1)),
            lastRow = set(static_cast<float>(tile.rows - 1));
  const IntVec run = hn::Set(kIntTag, tile.run), stride = hn::Set(kIntTag, tile.stride()),
               margin = hn::Set(kIntTag, tile.margin);
  const int row = tile.run * tile.stride();
  for (std::size_t k = 0; k < count; k += kLanes) {
    const IntVec bin = hn::LoadU(kIntTag, &points.bin[k]);
    alignas(64) std::int32_t place[kLanes] = {};
    const std::size_t own = std::min(kLanes, count - k);
    for (std::size_t lane = 0; lane < own; ++lane) place[lane] = tile.placeOfGroup(points.bin[k + lane] >> 2);
    const IntVec inRun = hn::Add(hn::LoadU(kIntTag, place), hn::And(bin, hn::Set(kIntTag, kGroupBins - 1)));
    const Vec x = load(&points.x[k]), y = load(&points.y[k]);
    const Vec fx = hn::Min(hn::Max(hn::Floor(x), zero), lastColumn), fy = hn::Min(hn::Max(hn::Floor(y), zero), lastRow);
    const Vec wx = hn::Sub(x, fx), wy = hn::Sub(y, fy), wd = hn::Sub(load(&points.depth[k]), hn::ConvertTo(kTag, bin));
    const IntVec node = hn::Add(hn::Mul(hn::Add(hn::ConvertTo(kIntTag, fy), margin), stride),
                                hn::Add(hn::ConvertTo(kIntTag, fx), margin));
    IntVec at = hn::Add(hn::Mul(node, run), inRun);
    if (own < kLanes) at = hn::IfThenElse(hn::FirstN(kIntTag, own), at, hn::Set(kIntTag, 1));
    for (std::size_t channel = 0; channel < tile.channels; ++channel) {
      const float* nodes = tile.values[channel];
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

/// The same from a field, for points placed on a patch.
void readPoints(const GridField& field, const GridPatch& patch, const GridPoints& points, std::size_t channels,
                float* depths) {
  const GridField::Face& face = field.faces[patch.face];
  const std::size_t count = points.count;
  const auto set32 = [](int value) { return hn::Set(kIntTag, value); };
  const Vec zero = hn::Zero(kTag), lastColumn = set(static_cast<float>(patch.columns - 1)),
            lastRow = set(static_cast<float>(patch.rows - 1));
  const IntVec column = set32(static_cast<int>(patch.firstColumn - face.firstColumn)),
               row = set32(static_cast<int>(patch.firstRow - face.firstRow)), pitch = set32(face.columns),
               firstBin = set32(static_cast<int>(patch.firstBin - face.firstBin));
  const std::int32_t* nodeAt = field.nodeAt.data() + face.firstNode;
  for (std::size_t k = 0; k < count; k += kLanes) {
    const std::size_t own = std::min(kLanes, count - k);
    const Vec x = load(&points.x[k]), y = load(&points.y[k]);
    const Vec fx = hn::Min(hn::Max(hn::Floor(x), zero), lastColumn), fy = hn::Min(hn::Max(hn::Floor(y), zero), lastRow);
    const IntVec cellX = hn::Add(hn::ConvertTo(kIntTag, fx), column), cellY = hn::Add(hn::ConvertTo(kIntTag, fy), row);
    IntVec node = hn::Add(hn::Mul(cellY, pitch), cellX), bin = hn::LoadU(kIntTag, &points.bin[k]);
    const Vec wx = hn::Sub(x, fx), wy = hn::Sub(y, fy), wd = hn::Sub(load(&points.depth[k]), hn::ConvertTo(kTag, bin));
    if (own < kLanes) {  // the others as the first
      const auto mine = hn::FirstN(kIntTag, own);
      node = hn::IfThenElse(mine, node, set32(static_cast<int>(hn::GetLane(node))));
      bin = hn::IfThenElse(mine, bin, set32(static_cast<int>(hn::GetLane(bin))));
    }
    bin = hn::Add(bin, firstBin);
    const auto runAt = [&](int offset) { return hn::Add(hn::GatherIndex(kIntTag, nodeAt + offset, node), bin); };
    const IntVec lower = runAt(0), lowerRight = runAt(1), upper = runAt(face.columns),
                 upperRight = runAt(face.columns + 1);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const float* values = field.values[channel].data();
      const auto across = [&](const float* from) {
        const auto gather = [&](IntVec at) { return hn::GatherIndex(kTag, from, at); };
        return between(between(gather(lower), gather(lowerRight), wx), between(gather(upper), gather(upperRight), wx),
                       wy);
      };
      const Vec before = across(values - 1), after = across(values);
      alignas(64) float out[kLanes];
      hn::Store(between(before, after, wd), kTag, out);
      std::copy_n(out, own, depths + channel * count + k);
    }
  }
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(read);
HWY_EXPORT(readPoints);

void readTile(const GridTile& tile, std::vector<float>& depths) {
  depths.resize(tile.channels * tile.receivers);
  HWY_DYNAMIC_DISPATCH(read)(tile, depths.data());
}
void readField(const GridField& field, const GridPatch& patch, const GridPoints& points, std::size_t channels,
               std::vector<float>& depths) {
  depths.resize(channels * points.count);
  HWY_DYNAMIC_DISPATCH(readPoints)(field, patch, points, channels, depths.data());
}

}  // namespace mote
#endif
