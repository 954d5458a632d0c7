// The four steps from a tree to optical depths, in plain words (scalar) and on vectors, equal bit for bit: find what
// lies in a column's way, place it in the column's frame, choose what a beam may meet, add that up along each of its
// rays.
#pragma once
#include <algorithm>
#include <limits>

#include "host/lighting/exact/beam.h"

namespace mote {

/// What a sum needs beside the beam.
struct SumOptions {
  layout::uint falloff = layout::kFalloffSmooth;
  layout::uint endpoint = layout::kEndpointSoft;
  /// A packet stops once every ray is beyond, in every channel.
  float opticalDepthLimit = std::numeric_limits<float>::infinity();
};

/// Optical depths of one packet.
struct PacketSums {
  alignas(64) float of[3][kPacketRays];
};

/// One way of doing all four.
struct BeamKernel {
  /// Particles of the tree whose support may touch the column, into column.gathered, in slot order.
  void (*gather)(const Octree& tree, Column& column);
  /// column.gathered → column.placed.
  void (*place)(Column& column);
  /// column.sorted → beam.particles.
  void (*choose)(const Column& column, std::size_t channels, Beam& beam);
  /// Adds the beam's particles and those near the light up along the packet's rays, from where they start toward the
  /// light, in each of the tree's channels.
  void (*sum)(const Column& column, const Beam& beam, std::size_t packet, std::size_t channels,
              const SumOptions& options, PacketSums& sums);
};

/// The plain way.
const BeamKernel& scalarBeamKernel();
/// With the best instruction set of this machine, chosen at the first call (Google Highway).
const BeamKernel& simdBeamKernel();

// What both ways share.

/// Particles between two looks at whether a packet is dark.
constexpr std::size_t kStride = 64;

inline float inverseSquareOf(float radius) {
  return std::min(1.0f / (radius * radius), static_cast<float>(kGreatestInverseArea));
}

/// How the beam's particles stand to the starts of a packet. Those before `between` lie wholly in every ray's way;
/// those from there to `end` may straddle a start; those behind have nothing in any ray's way.
struct PacketRange {
  std::size_t between, end;
  float deepest;  ///< … and neither has a particle whose `behind` is not less than this
};
inline PacketRange packetRange(const Column& column, const Beam& beam, std::size_t packet) {
  const float* depth = &beam.rays.depth[packet * kPacketRays];
  const float nearest = depth[0] - column.margin, deepest = depth[kPacketRays - 1] + column.margin;
  const auto behind = static_cast<float>(1 + kBehindRadii);
  const float *begin = beam.particles.reach.data(), *end = begin + beam.particles.count;
  const float* between = std::lower_bound(begin, end, nearest);
  const float* last = std::upper_bound(between, end, deepest + behind * column.sorted.greatestRadius);
  return {static_cast<std::size_t>(between - begin), static_cast<std::size_t>(last - begin), deepest};
}

}  // namespace mote
