#include "tools/bench/peers/fourier_map.h"

#include <cmath>
#include <memory>
#include <numbers>

#include "host/core/bins.h"
#include "host/core/error.h"
#include "host/core/parallel.h"
#include "tools/bench/peers/map_frame.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/bench/peers/fourier_map.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

#ifndef MOTE_PEERS_FOURIER_MAP_TYPES
#define MOTE_PEERS_FOURIER_MAP_TYPES
namespace mote {

constexpr int kTile = 16;             // texels a side: with 7 harmonics 16 KiB, half of a first-level cache
constexpr int kNarrow = 12;           // kernels up to as many texels across are scaled to keep their integral
constexpr int kRow = kTile + 16;      // a row of kernel values: the last vector may run over the end
constexpr float kLeastRadius = 1.0f;  // [texels]: what is narrower falls between the texels
constexpr int kMostNumbers = 2 * (63 + 1);

/// Texels whose centres may lie in a kernel; right and bottom inclusive.
struct Footprint {
  std::int16_t left, right, top, bottom;

  bool narrow() const { return right - left < kNarrow && bottom - top < kNarrow; }
};

struct FourierMap {
  MapFrame frame;
  float loU = 0, loV = 0, texel = 0;    // of the first texel's corner; side of a texel
  float nearest = 0, inverseRange = 0;  // depth 0 … 1
  int width = 0, height = 0, tilesWide = 0, tilesHigh = 0;
  int numbers = 0;                    // a texel: cosine and sine of harmonic 0, 1, …
  std::vector<float> x, y, z, depth;  // of each slot in the light's frame; depth: its distance, then 0 … 1
  std::vector<float> radius;          // of each slot's kernel, widened to kLeastRadius
  std::vector<float> scale;           // of each slot's kernel: optical depth at its middle
  std::vector<Footprint> footprint;
  std::unique_ptr<float[]> texels;  // [tile][texel of the tile][number]
  // Number n of a particle at depth d is cos(frequency d − phase). What it is worth from 0 to d:
  // offset + amplitude · cos(frequency d − shift) + slope · d.
  alignas(64) float frequency[kMostNumbers] = {}, phase[kMostNumbers] = {}, amplitude[kMostNumbers] = {},
                    shift[kMostNumbers] = {}, offset[kMostNumbers] = {}, slope[kMostNumbers] = {};
  alignas(64) float even[kMostNumbers] = {};  // 1 for cosines: what a particle is worth at its own depth
  bool thick = true;

  float* at(int u, int v) const {
    const int tile = (v / kTile) * tilesWide + u / kTile, place = (v % kTile) * kTile + u % kTile;
    return texels.get() + (std::size_t(tile) * kTile * kTile + std::size_t(place)) * std::size_t(numbers);
  }
};

}  // namespace mote
#endif

HWY_BEFORE_NAMESPACE();
namespace mote::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, 16>;
constexpr Tag kTag;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));

/// Places of the slots [begin, end) in the light's frame and their distance from it; least and greatest u, v, distance.
void projectSlots(FourierMap& map, const Octree& tree, std::size_t begin, std::size_t end, float* least, float* most) {
  const MapFrame& frame = map.frame;
  const auto infinite = hn::Set(kTag, INFINITY);
  hn::Vec<Tag> lo[3] = {infinite, infinite, infinite};
  hn::Vec<Tag> hi[3] = {hn::Neg(infinite), hn::Neg(infinite), hn::Neg(infinite)};
  for (std::size_t i = begin; i < end; i += kLanes) {
    // The block is whole vectors but for the last one of all, and the arrays have room for that.
    const auto px = hn::Sub(hn::LoadU(kTag, &tree.x[i]), hn::Set(kTag, frame.origin.x)),
               py = hn::Sub(hn::LoadU(kTag, &tree.y[i]), hn::Set(kTag, frame.origin.y)),
               pz = hn::Sub(hn::LoadU(kTag, &tree.z[i]), hn::Set(kTag, frame.origin.z));
    const auto along = [&](const vec3& axis) {
      return hn::MulAdd(px, hn::Set(kTag, axis.x),
                        hn::MulAdd(py, hn::Set(kTag, axis.y), hn::Mul(pz, hn::Set(kTag, axis.z))));
    };
    const auto x = along(frame.axis[0]), y = along(frame.axis[1]), z = along(frame.axis[2]);
    auto seen = std::array{x, y, z};
    if (frame.perspective)
      seen = {hn::Div(x, z), hn::Div(y, z), hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))))};
    hn::StoreU(x, kTag, &map.x[i]), hn::StoreU(y, kTag, &map.y[i]), hn::StoreU(z, kTag, &map.z[i]);
    hn::StoreU(seen[2], kTag, &map.depth[i]);
    const auto valid = hn::FirstN(kTag, end - i);
    for (int k = 0; k < 3; ++k) {
      lo[k] = hn::Min(lo[k], hn::IfThenElse(valid, seen[k], infinite));
      hi[k] = hn::Max(hi[k], hn::IfThenElse(valid, seen[k], hn::Neg(infinite)));
    }
  }
  for (int k = 0; k < 3; ++k) {
    least[k] = hn::GetLane(hn::MinOfLanes(kTag, lo[k]));
    most[k] = hn::GetLane(hn::MaxOfLanes(kTag, hi[k]));
  }
}

/// Values F of a slot's kernel at the texels [left, right] × [top, bottom], in rows of kRow; returns their sum.
HWY_INLINE float kernelValues(const FourierMap& map, std::size_t i, int left, int right, int top, int bottom,
                              float* values) {
  const auto x = hn::Set(kTag, map.x[i]), y = hn::Set(kTag, map.y[i]), z = hn::Set(kTag, map.z[i]);
  const auto inverse = hn::Set(kTag, 1 / (map.radius[i] * map.radius[i])), one = hn::Set(kTag, 1.0f);
  const auto zero = hn::Zero(kTag), last = hn::Set(kTag, static_cast<float>(right));
  auto sum = zero;
  for (int v = top; v <= bottom; ++v) {
    const auto fv = hn::Set(kTag, map.loV + (static_cast<float>(v) + 0.5f) * map.texel);
    for (int u = left; u <= right; u += kLanes) {
      const auto column = hn::Iota(kTag, static_cast<float>(u));
      const auto fu =
          hn::MulAdd(hn::Add(column, hn::Set(kTag, 0.5f)), hn::Set(kTag, map.texel), hn::Set(kTag, map.loU));
      auto square = zero;  // MapFrame::squaredDistance
      if (map.frame.perspective) {
        const auto a = hn::NegMulAdd(z, fv, y), b = hn::MulSub(z, fu, x), c = hn::Sub(hn::Mul(x, fv), hn::Mul(y, fu));
        square =
            hn::Div(hn::MulAdd(a, a, hn::MulAdd(b, b, hn::Mul(c, c))), hn::MulAdd(fu, fu, hn::MulAdd(fv, fv, one)));
      } else {
        const auto a = hn::Sub(x, fu), b = hn::Sub(y, fv);
        square = hn::MulAdd(a, a, hn::Mul(b, b));
      }
      const auto share = hn::Max(hn::NegMulAdd(square, inverse, one), zero);
      const auto value = hn::IfThenElseZero(hn::Le(column, last), hn::Mul(share, share));
      hn::StoreU(value, kTag, values + (v - top) * kRow + (u - left));
      sum = hn::Add(sum, value);
    }
  }
  return hn::GetLane(hn::SumOfLanes(kTag, sum));
}

/// Texels whose centres lie between lo and hi, held within 16 bits.
HWY_INLINE void texelsBetween(float lo, float hi, float start, float inverseTexel, std::int16_t& first,
                              std::int16_t& last) {
  first = static_cast<std::int16_t>(std::max(std::ceil((lo - start) * inverseTexel - 0.5f), -30000.0f));
  last = static_cast<std::int16_t>(std::min(std::floor((hi - start) * inverseTexel - 0.5f), 30000.0f));
}

/// Depths, kernels and footprints of the slots [begin, end).
void placeSlots(FourierMap& map, const Octree& tree, std::size_t begin, std::size_t end) {
  alignas(64) float values[kRow * kRow];
  const float inverseTexel = 1 / map.texel;
  for (std::size_t i = begin; i < end; ++i) {
    map.depth[i] = std::min(std::max((map.depth[i] - map.nearest) * map.inverseRange, 0.0f), 1.0f);
    const float x = map.x[i], y = map.y[i], z = map.frame.perspective ? map.z[i] : 1;
    // Interpolation adds a sixth of a texel² along each axis to the kernel's variance, r²/8. Taking half of it off
    // again gave the least errors (1 M particles, maps of 64² to 384²); all of it misses what falls between the texels.
    const float texel = map.texel * z, widened = tree.radius[i] * tree.radius[i] - 4.0f / 6 * texel * texel;
    const float r = std::max(std::sqrt(std::max(widened, 0.0f)), kLeastRadius * texel);
    map.radius[i] = r;
    map.scale[i] = tree.peak[i] * (tree.radius[i] / r) * (tree.radius[i] / r);
    Footprint& print = map.footprint[i];
    float areaScale = 1;  // of the texels' plane to a disc that faces the light
    if (map.frame.perspective) {
      // Where the rays that touch the ball meet the plane, seen along each axis.
      const float square = z * z - r * r, inverse = 1 / square;
      const float du = r * std::sqrt(std::max(x * x + square, 0.0f)),
                  dv = r * std::sqrt(std::max(y * y + square, 0.0f));
      texelsBetween((x * z - du) * inverse, (x * z + du) * inverse, map.loU, inverseTexel, print.left, print.right);
      texelsBetween((y * z - dv) * inverse, (y * z + dv) * inverse, map.loV, inverseTexel, print.top, print.bottom);
      areaScale = std::sqrt(x * x + y * y + z * z) / (z * z * z);
    } else {
      texelsBetween(x - r, x + r, map.loU, inverseTexel, print.left, print.right);
      texelsBetween(y - r, y + r, map.loV, inverseTexel, print.top, print.bottom);
    }
    if (!print.narrow()) continue;
    const float sum = kernelValues(map, i, print.left, print.right, print.top, print.bottom, values);
    const float integral = std::numbers::pi_v<float> / 3 * r * r * areaScale;
    map.scale[i] *= sum > 0 ? integral / (map.texel * map.texel * sum) : 0;
  }
}

/// What is left of the numbers of a slot that is no point in depth. The profile of a chord of half length c, 1 − x²,
/// has the transform 3 (sin ω − ω cos ω) / ω³ with ω = 2πkc, of which e^(−ω²/10) has the first two terms and no zeros.
/// c is 6/7 r, its mean over the kernel.
template <class D>
HWY_INLINE hn::Vec<D> damping(D tag, const FourierMap& map, std::size_t i, int n) {
  const float chord = 6.0f / 7 * map.radius[i] * map.inverseRange;
  const auto omega = hn::Mul(hn::Set(tag, chord), hn::Load(tag, map.frequency + n));
  return hn::Exp(tag, hn::Max(hn::Mul(hn::Set(tag, -0.1f), hn::Mul(omega, omega)), hn::Set(tag, -80.0f)));
}

/// Splats the slots of one tile, whose texels nobody else writes. kWidth: lanes at most, a divisor of map.numbers.
template <int kWidth>
HWY_INLINE void splatSlots(FourierMap& map, int tile, const std::uint32_t* slots, std::size_t count) {
  const hn::CappedTag<float, kWidth> tag;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(hn::CappedTag<float, kWidth>()));
  alignas(64) float basis[kMostNumbers], values[kRow * kTile];
  const int loU = (tile % map.tilesWide) * kTile, loV = (tile / map.tilesWide) * kTile;
  float* const texels = map.at(loU, loV);
  std::fill_n(texels, kTile * kTile * map.numbers, 0.0f);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = slots[k];
    const Footprint& print = map.footprint[i];
    const int left = std::max<int>(print.left, loU), right = std::min<int>(print.right, loU + kTile - 1);
    const int top = std::max<int>(print.top, loV), bottom = std::min<int>(print.bottom, loV + kTile - 1);
    kernelValues(map, i, left, right, top, bottom, values);
    const auto depth = hn::Set(tag, map.depth[i]), scale = hn::Set(tag, map.scale[i]);
    for (int n = 0; n < map.numbers; n += kStep) {
      const auto angle = hn::MulSub(depth, hn::Load(tag, map.frequency + n), hn::Load(tag, map.phase + n));
      auto number = hn::Mul(scale, hn::Cos(tag, angle));
      if (map.thick) number = hn::Mul(number, damping(tag, map, i, n));
      hn::Store(number, tag, basis + n);
    }
    for (int v = top; v <= bottom; ++v)
      for (int u = left; u <= right; ++u) {
        const float value = values[(v - top) * kRow + (u - left)];
        if (value <= 0) continue;
        const auto factor = hn::Set(tag, value);
        float* const texel = texels + ((v - loV) * kTile + (u - loU)) * map.numbers;
        for (int n = 0; n < map.numbers; n += kStep)
          hn::StoreU(hn::MulAdd(factor, hn::Load(tag, basis + n), hn::LoadU(tag, texel + n)), tag, texel + n);
      }
  }
}

/// Optical depths of the slots [begin, end) from the map.
template <int kWidth>
HWY_INLINE void lookUpSlots(const FourierMap& map, std::size_t begin, std::size_t end, float* depths) {
  const hn::CappedTag<float, kWidth> tag;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(hn::CappedTag<float, kWidth>()));
  for (std::size_t i = begin; i < end; ++i) {
    const float x = map.x[i], y = map.y[i], z = map.frame.perspective ? map.z[i] : 1;
    const float u = (x / z - map.loU) / map.texel - 0.5f, v = (y / z - map.loV) / map.texel - 0.5f;
    const int u0 = std::min(std::max(static_cast<int>(std::floor(u)), 0), map.width - 2);
    const int v0 = std::min(std::max(static_cast<int>(std::floor(v)), 0), map.height - 2);
    const float fu = std::min(std::max(u - static_cast<float>(u0), 0.0f), 1.0f),
                fv = std::min(std::max(v - static_cast<float>(v0), 0.0f), 1.0f);
    const float weight[4] = {(1 - fu) * (1 - fv), fu * (1 - fv), (1 - fu) * fv, fu * fv};
    const float* corner[4];
    float own = 0;
    const float inverse = 1 / (map.radius[i] * map.radius[i]);
    for (int c = 0; c < 4; ++c) {
      const int cu = u0 + (c & 1), cv = v0 + (c >> 1);
      corner[c] = map.at(cu, cv);
      const float square = map.frame.squaredDistance(x, y, z, map.loU + (static_cast<float>(cu) + 0.5f) * map.texel,
                                                     map.loV + (static_cast<float>(cv) + 0.5f) * map.texel);
      const float share = std::max(1 - square * inverse, 0.0f);
      own += weight[c] * share * share;
    }
    own *= map.scale[i];
    auto sum = hn::Zero(tag);
    const auto depth = hn::Set(tag, map.depth[i]);
    for (int n = 0; n < map.numbers; n += kStep) {
      auto blend = hn::Mul(hn::Set(tag, -own), hn::Load(tag, map.even + n));
      if (map.thick) blend = hn::Mul(blend, damping(tag, map, i, n));
      for (int c = 0; c < 4; ++c) blend = hn::MulAdd(hn::Set(tag, weight[c]), hn::LoadU(tag, corner[c] + n), blend);
      const auto cosine =
          hn::Cos(tag, hn::MulSub(depth, hn::Load(tag, map.frequency + n), hn::Load(tag, map.shift + n)));
      const auto worth = hn::MulAdd(hn::Load(tag, map.amplitude + n), cosine,
                                    hn::MulAdd(hn::Load(tag, map.slope + n), depth, hn::Load(tag, map.offset + n)));
      sum = hn::MulAdd(worth, blend, sum);
    }
    depths[i] = std::max(hn::GetLane(hn::SumOfLanes(tag, sum)), 0.0f);  // the series may swing below 0
  }
}

void splatTile(FourierMap& map, int tile, const std::uint32_t* slots, std::size_t count) {
  if (map.numbers % 16 == 0)
    splatSlots<16>(map, tile, slots, count);
  else
    splatSlots<8>(map, tile, slots, count);
}

void lookUp(const FourierMap& map, std::size_t begin, std::size_t end, float* depths) {
  if (map.numbers % 16 == 0)
    lookUpSlots<16>(map, begin, end, depths);
  else
    lookUpSlots<8>(map, begin, end, depths);
}

}  // namespace mote::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mote {

HWY_EXPORT(projectSlots);
HWY_EXPORT(placeSlots);
HWY_EXPORT(splatTile);
HWY_EXPORT(lookUp);

namespace {

constexpr std::size_t kGrain = 4096;  // slots a task, whole vectors

/// ∫₀ᵈ of the series Σ [cos 2πk dⱼ · 2 cos 2πk t + sin 2πk dⱼ · 2 sin 2πk t], with 1 instead of 2 for k = 0:
/// d + Σ_k cos 2πk dⱼ · sin 2πk d / πk + sin 2πk dⱼ · (1 − cos 2πk d) / πk. At dⱼ = d the sum of its first halves.
void fillSeries(FourierMap& map) {
  constexpr float kQuarter = std::numbers::pi_v<float> / 2;
  for (int n = 0; n < map.numbers; ++n) {
    const bool sine = n % 2 == 1;
    const auto k = static_cast<float>(n / 2);
    map.frequency[n] = 2 * std::numbers::pi_v<float> * k;
    map.phase[n] = sine ? kQuarter : 0;
    map.even[n] = sine ? 0 : 1;
    if (k == 0) {
      map.slope[n] = sine ? 0 : 1;
    } else {
      const float worth = 1 / (std::numbers::pi_v<float> * k);
      map.amplitude[n] = sine ? -worth : worth;
      map.shift[n] = sine ? 0 : kQuarter;
      map.offset[n] = sine ? worth : 0;
    }
  }
}

/// The window of the map and the range of depths: of all centres, where everything is looked up.
void fitMap(FourierMap& map, const Octree& tree, int size) {
  const std::size_t count = tree.particleCount(), padded = count + kSlotPadding;
  for (std::vector<float>* array : {&map.x, &map.y, &map.z, &map.depth}) array->resize(padded);
  map.radius.resize(count), map.scale.resize(count), map.footprint.resize(count);
  std::vector<vec3> least((count + kGrain - 1) / kGrain), most(least.size());
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(projectSlots)
    (map, tree, begin, end, &least[begin / kGrain].x, &most[begin / kGrain].x);
  });
  Bounds seen;
  for (std::size_t block = 0; block < least.size(); ++block) seen.add(least[block]), seen.add(most[block]);
  const vec3 range = seen.size();
  map.nearest = seen.lo.z;
  map.inverseRange = range.z > 0 ? 1 / range.z : 0;
  map.texel = std::max(std::max(range.x, range.y) / static_cast<float>(size), 1e-20f);
  const auto texels = [&](float length) {
    return std::min(std::max(static_cast<int>(std::ceil(length / map.texel)), 2), size);
  };
  map.width = texels(range.x), map.height = texels(range.y);
  map.loU = seen.lo.x, map.loV = seen.lo.y;
  map.tilesWide = (map.width + kTile - 1) / kTile, map.tilesHigh = (map.height + kTile - 1) / kTile;
}

}  // namespace

std::size_t fourierMapBytes(const FourierMapOptions& options) {
  const std::size_t side = (std::size_t(options.size) + kTile - 1) / kTile * kTile;
  return side * side * std::size_t(options.harmonics + 1) * 2 * sizeof(float);
}

std::vector<float> fourierMapDepths(const Octree& tree, const layout::Light& light, const FourierMapOptions& options) {
  MOTE_CHECK(tree.channels(), ==, 1u);
  MOTE_CHECK((2 * (options.harmonics + 1)) % 8, ==, 0);
  MOTE_CHECK(2 * (options.harmonics + 1), <=, kMostNumbers);
  const std::size_t count = tree.particleCount();
  std::vector<float> depths(count);
  if (count == 0) return depths;
  FourierMap map;
  map.frame = mapFrame(tree, light);
  map.numbers = 2 * (options.harmonics + 1);
  map.thick = options.thick;
  fillSeries(map);
  fitMap(map, tree, options.size);
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(placeSlots)(map, tree, begin, end);
  });

  const auto tiles = static_cast<std::size_t>(map.tilesWide * map.tilesHigh);
  const Binned<std::uint32_t> bins =
      sortIntoBins<std::uint32_t>(count, tiles, [&](std::size_t begin, std::size_t end, const auto& put) {
        for (std::size_t i = begin; i < end; ++i) {
          const Footprint& print = map.footprint[i];
          const int left = std::max<int>(print.left, 0) / kTile, right = std::min<int>(print.right, map.width - 1);
          const int top = std::max<int>(print.top, 0) / kTile, bottom = std::min<int>(print.bottom, map.height - 1);
          if (right < 0 || bottom < 0) continue;
          for (int v = top; v <= bottom / kTile; ++v)
            for (int u = left; u <= right / kTile; ++u)
              put(static_cast<std::size_t>(v * map.tilesWide + u), static_cast<std::uint32_t>(i));
        }
      });
  map.texels = std::make_unique_for_overwrite<float[]>(tiles * kTile * kTile * std::size_t(map.numbers));
  parallelBlocks(tiles, 1, [&](std::size_t tile, std::size_t) {
    const std::span<const std::uint32_t> items = bins.of(tile);
    HWY_DYNAMIC_DISPATCH(splatTile)(map, static_cast<int>(tile), items.data(), items.size());
  });
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(lookUp)(map, begin, end, depths.data());
  });
  return depths;
}

}  // namespace mote
#endif
