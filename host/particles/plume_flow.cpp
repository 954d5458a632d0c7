#include "host/particles/plume_flow.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/noise.h"

namespace mote {
namespace {

// ---- the column: a turbulent plume (Morton, Taylor and Turner 1956): radius linear, axis speed as height^(-1/3) ----
constexpr float kSourceRadius = 0.105f, kSpread = 0.20f, kSourceSpeed = 1.25f, kSpeedHeight = 0.30f;
// Above these heights the smoke is no lighter than the air: the upward flux fades and turns outwards, an umbrella.
constexpr float kFluxFades = 0.9f, kFluxEnds = 2.5f;

struct Flux {
  float value, slope;
};

/// Upward volume flux over 2π, and its derivative by height.
Flux flux(float y) {
  const auto at = [](float h) {
    const float b = PlumeFlow::columnRadius(h);
    return 0.5f * PlumeFlow::axisSpeed(h) * b * b;
  };
  constexpr float h = 1.0f / 64;  // wide enough for float differences, far narrower than the column's features
  return {at(y), (at(y + h) - at(y - h)) / (2 * h)};
}

/// flux() in a table over height.
struct FluxTable {
  static constexpr int kEntries = 512;
  static constexpr float kLo = -0.3f, kHi = 2.5f;
  Flux entry[kEntries + 1];
  FluxTable() {
    for (int i = 0; i <= kEntries; ++i) entry[i] = flux(kLo + (kHi - kLo) * static_cast<float>(i) / kEntries);
  }
  Flux at(float y) const {
    const float x = glm::clamp((y - kLo) / (kHi - kLo), 0.0f, 0.99999f) * kEntries;
    const int i = static_cast<int>(x);
    const float t = x - static_cast<float>(i);
    return {entry[i].value + t * (entry[i + 1].value - entry[i].value),
            entry[i].slope + t * (entry[i + 1].slope - entry[i].slope)};
  }
};

// ---- vortices: large rings leave the source at a steady beat and make the column puff; each smaller size is born all
// along the shear layer at its edge, as turbulence cascades, and pushes out billows that the next smaller ones curl
// ----
struct VortexKind {
  double interval;        ///< between births [s]
  double lifetime;        ///< [s]
  float support;          ///< R at birth [column radii at that height]
  float growth;           ///< of R [1/s]
  float strength;         ///< speed at its centre [axis speeds at that height]
  float edge;             ///< distance of births from the axis [column radii]
  float lowest, highest;  ///< heights of births [units]
  float upward;           ///< share of "up" in the ring's axis; the rest points outwards
  float chance;           ///< length of a random vector added to the axis
  float cell;             ///< of the search grid [units]
};
constexpr VortexKind kKinds[] = {
    {0.36, 3.0, 2.0f, 0.25f, 0.50f, 0.25f, 0.00f, 0.06f, 1.0f, 0.35f, 0.30f},
    {0.040, 1.8, 0.95f, 0.30f, 0.60f, 0.70f, -0.05f, 1.90f, 0.5f, 0.5f, 0.12f},
    {0.012, 1.1, 0.50f, 0.30f, 0.60f, 0.80f, -0.05f, 2.00f, 0.3f, 0.8f, 0.10f},
    {0.0040, 0.7, 0.27f, 0.30f, 0.45f, 0.85f, -0.03f, 2.00f, 0.2f, 1.0f, 0.07f},
};
// A ring drives itself along its axis with about a third of the speed at its centre (as Hill's vortex against its
// core).
constexpr float kSelfPropulsion = 0.33f;

int stepsOf(double seconds) { return static_cast<int>(std::ceil(seconds / kPlumeStep)) + 1; }

// ---- cells that find the vortices near a point; nothing of the plume leaves this box ----
constexpr vec3 kCellsLo(-1.3f, -0.3f, -1.3f), kCellsHi(1.3f, 2.7f, 1.3f);

struct CellGrid {
  explicit CellGrid(float cellSize)
      : inverse(1 / cellSize), n(glm::ivec3(glm::ceil((kCellsHi - kCellsLo) * inverse))) {}
  int count() const { return n.x * n.y * n.z; }
  glm::ivec3 cell(const vec3& p) const { return glm::ivec3(glm::floor((p - kCellsLo) * inverse)); }
  bool holds(const glm::ivec3& c) const {
    return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < n.x && c.y < n.y && c.z < n.z;
  }
  int index(const glm::ivec3& c) const { return (c.z * n.y + c.y) * n.x + c.x; }
  float inverse;
  glm::ivec3 n;
};
const CellGrid kGrids[] = {CellGrid(kKinds[0].cell), CellGrid(kKinds[1].cell), CellGrid(kKinds[2].cell),
                           CellGrid(kKinds[3].cell)};

// ---- four numbers at once: GCC's and Clang's vector type, SSE on x86 and NEON on ARM, rounding like float ----
using Float4 = float __attribute__((vector_size(16)));
Float4 load(const float* four) {
  Float4 v;
  std::memcpy(&v, four, sizeof v);
  return v;
}
float sum(const Float4& v) { return (v[0] + v[1]) + (v[2] + v[3]); }

/// Calls visit(cell index) for the cells that the box around a ball covers.
template <class Visit>
void forCells(const CellGrid& grid, const vec3& centre, float radius, const Visit& visit) {
  const glm::ivec3 lo = glm::max(grid.cell(centre - radius), glm::ivec3(0)),
                   hi = glm::min(grid.cell(centre + radius), grid.n - 1);
  for (int z = lo.z; z <= hi.z; ++z)
    for (int y = lo.y; y <= hi.y; ++y)
      for (int x = lo.x; x <= hi.x; ++x) visit(static_cast<std::size_t>(grid.index({x, y, z})));
}

}  // namespace

float PlumeFlow::columnRadius(float y) {
  return kSourceRadius + kSpread * 0.5f * (y + std::sqrt(y * y + 0.01f));  // linear above the ground, constant below
}

float PlumeFlow::axisSpeed(float y) {
  const float height = std::max(y, 0.0f);
  return kSourceSpeed / std::cbrt(1 + height / kSpeedHeight) * (1 - smoothStep(kFluxFades, kFluxEnds, y));
}

vec3 PlumeFlow::column(const vec3& p) {
  static const FluxTable table;
  // Stokes stream function ψ = Q(y) · (1 − exp(−r²/b²)); u_y = ∂ψ/∂r / r, u_r = −∂ψ/∂y / r.
  const Flux q = table.at(p.y);
  const float root = std::sqrt(p.y * p.y + 0.01f);
  const float b = kSourceRadius + kSpread * 0.5f * (p.y + root), slope = kSpread * 0.5f * (1 + p.y / root);
  const float rr = p.x * p.x + p.z * p.z, s = rr / (b * b), e = std::exp(-s);
  const float share = s < 1e-3f ? (1 - 0.5f * s) / (b * b) : (1 - e) / rr;  // (1 − exp(−s)) / r², also on the axis
  const float outwards = -q.slope * share + q.value * 2 * slope / (b * b * b) * e;
  return {outwards * p.x, q.value * 2 / (b * b) * e, outwards * p.z};
}

vec3 PlumeFlow::vortices(const vec3& p, int step, int levels) const {
  Float4 ux{}, uy{}, uz{};
  for (int level = 0; level < levels; ++level) {
    const CellGrid& grid = kGrids[level];
    const glm::ivec3 c = grid.cell(p);
    if (!grid.holds(c)) continue;
    const Layer& layer = layers_[level][static_cast<std::size_t>(step - begin_[level])];
    const auto cell = static_cast<std::size_t>(grid.index(c));
    const Vortex4* v = layer.inCells.data() + layer.cellBegin[cell];
    const Vortex4* const end = layer.inCells.data() + layer.cellBegin[cell + 1];
    for (; v != end; ++v) {
      const Float4 x = p.x - load(v->x), y = p.y - load(v->y), z = p.z - load(v->z);
      const Float4 inverse = load(v->inverseSquare), nx = load(v->pushX), ny = load(v->pushY), nz = load(v->pushZ);
      const Float4 rr = x * x + y * y + z * z;
      Float4 g = 1.0f - rr * inverse;
      g = g > 0.0f ? g : Float4{};  // nothing outside the support; no branch, it could not be predicted
      // curl(f n × x / 2) = f n + f′/R² (n |x|² − x (n·x)), f = g³, f′ = df/d(|x|²/R²) = −3 g².
      const Float4 gg = g * g, turn = 3.0f * gg * inverse;
      const Float4 along = gg * g - turn * rr, around = turn * (nx * x + ny * y + nz * z);
      ux += along * nx + around * x;
      uy += along * ny + around * y;
      uz += along * nz + around * z;
    }
  }
  return {sum(ux), sum(uy), sum(uz)};
}

PlumeFlow::PlumeFlow(std::uint64_t seed, int first, int last) {
  // A vortex is carried by the larger ones from its birth on, so larger sizes are needed from further back.
  for (int level = kLevels - 1, begin = first; level >= 0; --level) {
    begin_[level] = begin;
    begin -= stepsOf(kKinds[level].lifetime);
  }
  for (int level = 0; level < kLevels; ++level) traceLevel(seed, level, last);
}

void PlumeFlow::traceLevel(std::uint64_t seed, int level, int last) {
  const VortexKind& kind = kKinds[level];
  const CellGrid& grid = kGrids[level];
  std::vector<Layer>& layers = layers_[level];
  layers.resize(static_cast<std::size_t>(last - begin_[level] + 1));
  const auto firstIndex =
      static_cast<std::int64_t>(std::floor((begin_[level] * kPlumeStep - kind.lifetime) / kind.interval));
  const auto lastIndex = static_cast<std::int64_t>(std::ceil(last * kPlumeStep / kind.interval));
  for (std::int64_t index = firstIndex; index <= lastIndex; ++index) traceVortex(seed, level, index, last);
  parallelBlocks(layers.size(), 1, [&](std::size_t begin, std::size_t) {
    Layer& layer = layers[begin];
    std::vector<std::uint32_t> fill(static_cast<std::size_t>(grid.count()), 0);
    for (const Vortex& v : layer.vortices) forCells(grid, v.centre, v.support, [&](std::size_t c) { ++fill[c]; });
    layer.cellBegin.assign(fill.size() + 1, 0);
    for (std::size_t c = 0; c < fill.size(); ++c) layer.cellBegin[c + 1] = layer.cellBegin[c] + (fill[c] + 3) / 4;
    layer.inCells.resize(layer.cellBegin.back());
    std::fill(fill.begin(), fill.end(), 0);
    for (const Vortex& v : layer.vortices)
      forCells(grid, v.centre, v.support, [&](std::size_t c) {
        const std::uint32_t place = fill[c]++;
        Vortex4& four = layer.inCells[layer.cellBegin[c] + place / 4];
        const std::uint32_t k = place % 4;
        four.x[k] = v.centre.x, four.y[k] = v.centre.y, four.z[k] = v.centre.z;
        four.inverseSquare[k] = 1 / (v.support * v.support);
        four.pushX[k] = v.push.x, four.pushY[k] = v.push.y, four.pushZ[k] = v.push.z;
      });
  });
}

void PlumeFlow::traceVortex(std::uint64_t seed, int level, std::int64_t index, int last) {
  const VortexKind& kind = kKinds[level];
  Random random(hashBits(seed, static_cast<std::uint64_t>(level), 0x507), static_cast<std::uint64_t>(index));
  const double birth = (static_cast<double>(index) + 0.5 * random.uniform()) * kind.interval;
  // More of them low, where the column is thin and they are small.
  const auto height = kind.lowest + (kind.highest - kind.lowest) * static_cast<float>(std::pow(random.uniform(), 2.0));
  const double angle = random.uniform(0, 2 * kPi);
  const vec3 outwards(std::cos(angle), 0, std::sin(angle));
  const float radius = columnRadius(height);
  Vortex v;
  v.centre = outwards * (kind.edge * radius * static_cast<float>(random.uniform(0.7, 1.1))) + vec3(0, height, 0);
  vec3 axis = kind.upward * vec3(0, 1, 0) + (1 - kind.upward) * outwards + kind.chance * vec3(random.direction());
  axis = glm::normalize(axis + vec3(0, 1e-3f, 0));  // never of length 0
  const float support = kind.support * radius * static_cast<float>(random.uniform(0.75, 1.25));
  const float strength = kind.strength * static_cast<float>(random.uniform(0.6, 1.4));
  const int birthStep = static_cast<int>(std::ceil(birth / kPlumeStep));
  for (int step = birthStep; step <= last; ++step) {
    const auto age = static_cast<float>(step * kPlumeStep - birth), life = static_cast<float>(kind.lifetime);
    if (age >= life) return;
    v.support = support * (1 + kind.growth * age);
    // In the umbrella, where the axis speed fades, the eddies live on what came up from below.
    const float fade = smoothStep(0, 0.15f * life, age) * (1 - smoothStep(0.4f * life, life, age));
    v.push = strength * std::max(axisSpeed(v.centre.y), 0.2f) * fade * axis;
    if (step >= begin_[level]) layers_[level][static_cast<std::size_t>(step - begin_[level])].vortices.push_back(v);
    const vec3 carried = level == 0 ? column(v.centre) : column(v.centre) + vortices(v.centre, step, level);
    v.centre += static_cast<float>(kPlumeStep) * (carried + kSelfPropulsion * v.push);
  }
}

}  // namespace mote
