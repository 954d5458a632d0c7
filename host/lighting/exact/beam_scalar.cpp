// The steps of columns and beams in plain words. Everything here is in a fixed order of operations; beam_simd.cpp does
// the same on vectors, and a test compares the bits.
#include <algorithm>
#include <cmath>

#include "host/lighting/exact/beam_kernel.h"
#include "host/lighting/exact/rules.h"

namespace mote {
namespace {

// ---- gather

bool outside(const ColumnPlanes& planes, const layout::Node& node) {
  const vec3 half = 0.5f * (node.hi - node.lo), centre = 0.5f * (node.lo + node.hi) - planes.origin;
  for (int k = 0; k < 8; ++k) {
    const float distance = centre.x * planes.x[k] + centre.y * planes.y[k] + centre.z * planes.z[k];
    const float reach = half.x * planes.absX[k] + half.y * planes.absY[k] + half.z * planes.absZ[k];
    if (distance - planes.offset[k] > reach) return true;
  }
  return false;
}

bool touches(const ColumnPlanes& planes, const Octree& tree, std::uint32_t slot) {
  const float radius = tree.radius[slot];
  if (!(radius > 0)) return false;
  const float x = tree.x[slot] - planes.origin.x, y = tree.y[slot] - planes.origin.y,
              z = tree.z[slot] - planes.origin.z;
  for (int k = 0; k < kColumnPlanes; ++k)
    if (x * planes.x[k] + y * planes.y[k] + z * planes.z[k] - planes.offset[k] > radius) return false;
  return true;
}

void gather(const Octree& tree, Column& column) {
  GatheredParticles& found = column.gathered;
  found.count = 0;
  const std::vector<float>* peaks[] = {&tree.peak, &tree.peakGreen, &tree.peakBlue};
  const auto nodes = static_cast<std::uint32_t>(tree.nodeCount());
  for (std::uint32_t index = 0; index < nodes;) {
    const layout::Node& node = tree.nodes[index];
    if (outside(column.planes, node)) {
      index = node.skip;
      continue;
    }
    if (node.skip != ++index) continue;  // not a leaf
    const std::uint32_t end = tree.nodes[index].first;
    found.reserve(end - node.first, tree.channels());
    for (std::uint32_t slot = node.first; slot < end; ++slot) {
      if (!touches(column.planes, tree, slot)) continue;
      const std::size_t i = found.count++;
      found.x[i] = tree.x[slot], found.y[i] = tree.y[slot], found.z[i] = tree.z[slot];
      found.radius[i] = tree.radius[slot];
      for (std::size_t c = 0; c < tree.channels(); ++c) found.peak[c][i] = (*peaks[c])[slot];
      found.slot[i] = slot;
    }
  }
}

// ---- place

double dot(const dvec3& a, const dvec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float lowPart(double value) { return static_cast<float>(value - static_cast<double>(static_cast<float>(value))); }

void place(Column& column) {
  const LightFrame& frame = column.frame;
  const GatheredParticles& found = column.gathered;
  PlacedParticles& placed = column.placed;
  placed.resize(found.count);
  for (std::size_t i = 0; i < found.count; ++i) {
    const double r = found.radius[i];
    const dvec3 p = dvec3(found.x[i], found.y[i], found.z[i]) - frame.origin;
    const double x = dot(p, frame.u), y = dot(p, frame.v), z = dot(p, frame.axis);
    double u = x, v = y, depth = z, extent = r, perRadius = 1 / r;
    placed.sagFirst[i] = placed.sagRatio[i] = 0;
    placed.place[i] = Place::Sorted;
    if (frame.perspective) {
      depth = std::sqrt(x * x + y * y + z * z);
      u = x / z, v = y / z, extent = r / z, perRadius = z / r;
      placed.sagFirst[i] = static_cast<float>(0.5 / depth);
      placed.sagRatio[i] = static_cast<float>(1 / (depth * depth));
      placed.nearX[i] = static_cast<float>(x), placed.nearY[i] = static_cast<float>(y);
      placed.nearZ[i] = static_cast<float>(z);
      placed.place[i] = depth < kNearLightRadii * r ? Place::NearLight
                        : z > kLeastCosine * depth  ? Place::Sorted
                                                    : Place::Behind;
    }
    placed.u[i] = static_cast<float>(u), placed.uLow[i] = lowPart(u);
    placed.v[i] = static_cast<float>(v), placed.vLow[i] = lowPart(v);
    placed.extent[i] = static_cast<float>(extent);
    placed.inverseArea[i] = static_cast<float>(std::min(perRadius * perRadius, kGreatestInverseArea));
    placed.reach[i] = static_cast<float>(depth + r - column.depthBase);
    placed.behind[i] = static_cast<float>(depth - kBehindRadii * r - column.depthBase);
    placed.depth[i] = static_cast<float>(depth - column.depthBase);
    placed.depthLow[i] = lowPart(depth - column.depthBase);
  }
}

// ---- choose

void choose(const Column& column, std::size_t channels, Beam& beam) {
  const SortedParticles& from = column.sorted;
  BeamParticles& to = beam.particles;
  to.resize(from.count, channels);
  to.count = 0;
  const auto& turn = beam.turn;
  for (std::size_t k = 0; k < from.count; ++k) {
    const float u = from.u[k], v = from.v[k], extent = from.extent[k] * beam.extentScale;
    if (u - extent > beam.highU || u + extent < beam.lowU || v - extent > beam.highV || v + extent < beam.lowV)
      continue;
    const std::size_t i = to.count++;
    const float w = u * turn[2][0] + v * turn[2][1] + turn[2][2];
    to.u[i] = (u * turn[0][0] + v * turn[0][1] + turn[0][2]) / w;
    to.v[i] = (u * turn[1][0] + v * turn[1][1] + turn[1][2]) / w;
    to.inverseArea[i] = from.inverseArea[k] * (w * w);
    for (std::size_t c = 0; c < channels; ++c) to.peak[c][i] = from.peak[c][k];
    to.reach[i] = from.reach[k];
    to.index[i] = from.index[k];
  }
}

// ---- sum

/// b²/r² of a particle from one ray.
template <bool kCareful>
float separation(const Column& column, const Beam& beam, std::size_t ray, std::size_t k) {
  const BeamRays& rays = beam.rays;
  const BeamParticles& particles = beam.particles;
  float du = particles.u[k] - rays.u[ray], dv = particles.v[k] - rays.v[ray];
  if constexpr (!kCareful) return (du * du + dv * dv) * particles.inverseArea[k];
  const std::uint32_t index = particles.index[k];
  du = du + (column.placed.uLow[index] - rays.uLow[ray]), dv = dv + (column.placed.vLow[index] - rays.vLow[ray]);
  const float cross = du * rays.slopeV[ray] - dv * rays.slopeU[ray];
  return (du * du + dv * dv + cross * cross) * (particles.inverseArea[k] * rays.inverseNorm[ray]);
}

/// Falloff times the share before a start at the distance t of the centre's place on the ray.
template <layout::uint kFalloff>
float softShare(float q, float t, float radius, float inverseRadius) {
  if constexpr (kFalloff != layout::kFalloffSmooth)
    return falloff<kFalloff>(q) * cap(t, radius * std::sqrt(std::max(1.0f - q, 0.0f)));
  // s⁴ · (½ + ¾x − ¼x³) with s = √(1 − q) and x = t/(r·s) is s/4 · (s + t/r)² · (2s − t/r): no division, and exactly 0
  // where nothing lies before the start.
  const float s = std::sqrt(std::max(1.0f - q, 0.0f));
  const float x = std::min(std::max(t * inverseRadius, 0.0f - s), s);
  return (0.25f * s) * ((s + x) * (s + x)) * ((s + s) - x);
}

/// The sum of one packet, with everything that is decided at compile time.
template <int kChannels, layout::uint kFalloff, layout::uint kEndpoint, bool kCareful>
class PacketSum {
 public:
  PacketSum(const Column& column, const Beam& beam, std::size_t packet, PacketSums& sums)
      : column_(column), beam_(beam), packet_(packet), first_(packet * kPacketRays), sums_(sums) {
    for (int c = 0; c < kChannels; ++c) std::fill(sums_.of[c], sums_.of[c] + kPacketRays, 0.0f);
  }

  void run(float limit) {
    const PacketRange range = packetRange(column_, beam_, packet_);
    for (std::size_t k = range.end; k-- > range.between;)
      if (column_.placed.behind[beam_.particles.index[k]] < range.deepest) addNearStart(k);
    for (std::size_t end = range.between; end > 0;) {
      if (allBeyond(limit)) return;
      const std::size_t begin = end > kStride ? end - kStride : 0;
      for (std::size_t k = end; k-- > begin;) addBetween(k);
      end = begin;
    }
    for (const std::uint32_t index : column_.nearLight) addNearLight(index);
  }

 private:
  struct Peaks {
    float of[kChannels];
  };
  Peaks peaksOf(const std::vector<float> (&arrays)[3], std::size_t k) const {
    Peaks peaks;
    for (int c = 0; c < kChannels; ++c) peaks.of[c] = arrays[c][k];
    return peaks;
  }

  template <class Share>
  void add(const Peaks& peaks, const Share& share) {
    for (int lane = 0; lane < kPacketRays; ++lane) {
      const float s = share(first_ + static_cast<std::size_t>(lane));
      for (int c = 0; c < kChannels; ++c) sums_.of[c][lane] += peaks.of[c] * s;
    }
  }

  void addBetween(std::size_t k) {
    add(peaksOf(beam_.particles.peak, k),
        [&](std::size_t ray) { return falloff<kFalloff>(separation<kCareful>(column_, beam_, ray, k)); });
  }

  void addNearStart(std::size_t k) {
    const PlacedParticles& placed = column_.placed;
    const BeamRays& rays = beam_.rays;
    const std::uint32_t index = beam_.particles.index[k], slot = column_.gathered.slot[index];
    const float radius = column_.gathered.radius[index], square = radius * radius;
    const float inverseRadius = 1.0f / radius, inverseSquare = inverseSquareOf(radius);
    add(peaksOf(beam_.particles.peak, k), [&](std::size_t ray) -> float {
      const float q = separation<kCareful>(column_, beam_, ray, k);
      const float b2 = q * square;
      const float sag = b2 * placed.sagFirst[index] * (1.0f + 0.25f * (b2 * placed.sagRatio[index]));
      // From the particle's middle on the ray to the start: how much of the ray lies toward the light from it.
      const float t = (rays.depth[ray] - placed.depth[index]) + ((rays.depthLow[ray] - placed.depthLow[index]) + sag);
      float share;
      if constexpr (kEndpoint == layout::kEndpointSoft) {
        share = softShare<kFalloff>(q, t, radius, inverseRadius);
      } else {
        // What lies behind the start counts from there: the distance to the segment instead of the line.
        const float back = std::min(t, 0.0f);
        share = falloff<kFalloff>(q + back * back * inverseSquare);
      }
      return rays.self[ray] == slot ? 0.0f : share;
    });
  }

  void addNearLight(std::uint32_t index) {
    const PlacedParticles& placed = column_.placed;
    const BeamRays& rays = beam_.rays;
    const float x = placed.nearX[index], y = placed.nearY[index], z = placed.nearZ[index];
    const float radius = column_.gathered.radius[index], inverseSquare = inverseSquareOf(radius);
    const std::uint32_t slot = column_.gathered.slot[index];
    add(peaksOf(column_.gathered.peak, index), [&](std::size_t ray) -> float {
      const float fromLight = x * rays.x[ray] + y * rays.y[ray] + z * rays.z[ray];
      float s = fromLight;
      if constexpr (kEndpoint == layout::kEndpointClamp) s = std::min(std::max(s, 0.0f), rays.length[ray]);
      const float ex = x - s * rays.x[ray], ey = y - s * rays.y[ray], ez = z - s * rays.z[ray];
      const float q = (ex * ex + ey * ey + ez * ez) * inverseSquare;
      float share = falloff<kFalloff>(q);
      if constexpr (kEndpoint == layout::kEndpointSoft) {
        const float halfChord = radius * std::sqrt(std::max(1.0f - q, 0.0f));
        share = share * cap(rays.length[ray] - fromLight, halfChord) * cap(fromLight, halfChord);
      }
      return rays.self[ray] == slot ? 0.0f : share;
    });
  }

  bool allBeyond(float limit) const {
    for (int c = 0; c < kChannels; ++c)
      for (int lane = 0; lane < kPacketRays; ++lane)
        if (!(sums_.of[c][lane] > limit)) return false;
    return true;
  }

  const Column& column_;
  const Beam& beam_;
  std::size_t packet_, first_;
  PacketSums& sums_;
};

void sum(const Column& column, const Beam& beam, std::size_t packet, std::size_t channels, const SumOptions& options,
         PacketSums& sums) {
  withRule(options.falloff, options.endpoint, [&]<layout::uint kFalloff, layout::uint kEndpoint>() {
    const auto run = [&]<int kChannels, bool kCareful>() {
      PacketSum<kChannels, kFalloff, kEndpoint, kCareful>(column, beam, packet, sums).run(options.opticalDepthLimit);
    };
    if (channels == 1)
      beam.careful ? run.template operator()<1, true>() : run.template operator()<1, false>();
    else
      beam.careful ? run.template operator()<3, true>() : run.template operator()<3, false>();
  });
}

}  // namespace

const BeamKernel& scalarBeamKernel() {
  static const BeamKernel kernel{gather, place, choose, sum};
  return kernel;
}

}  // namespace mote
