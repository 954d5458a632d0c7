// One beam of a column: at most a few hundred rays that are added up against the same list of particles.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/exact/column.h"

namespace mote {

/// Arrays of all rays of a beam, by depth from the light outward; padded to whole packets by repeating the last ray.
struct BeamRays {
  std::vector<float> u, uLow, v, vLow;  ///< in the beam's frame; uLow, vLow: what rounding left
  std::vector<float> slopeU, slopeV;    ///< point lights: u and v again, as slopes; directional: 0
  std::vector<float> inverseNorm;       ///< 1 / (1 + slope²)
  std::vector<float> depth, depthLow;   ///< of the starts, from the column's depthBase; +∞ for whole lines
  std::vector<float> x, y, z, length;   ///< point lights: direction along the column's axes (unit), way to the light
  std::vector<std::uint32_t> self;      ///< slot that the ray leaves out, or kNoSlot
  std::vector<std::uint32_t> receiver;  ///< not padded
  std::size_t packets() const { return u.size() / kPacketRays; }
};

/// The column's particles that the beam may meet, in the beam's frame, by ascending reach.
struct BeamParticles {
  std::size_t count = 0;
  std::vector<float> u, v, inverseArea, peak[3], reach;
  std::vector<std::uint32_t> index;  ///< into the column's gathered and placed
  void resize(std::size_t count, std::size_t channels);
};

/// Set up again for each beam; holds on to its memory.
struct Beam {
  BeamRays rays;
  BeamParticles particles;
  /// Wide, or in a precise column: the frame is the column's, and b² needs all of its terms and the low parts.
  bool careful = false;
  /// The beam's rectangle in the column's frame, and the factor on extents that makes it hold all that touches the
  /// beam.
  float lowU = 0, highU = 0, lowV = 0, highV = 0, extentScale = 1;
  /// From the column's frame into the beam's: (u, v, 1) → rows · (u, v, 1), divided by the third.
  float turn[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

  /// Rays from `members`, some of those that the column was set for; `inColumnFrame`: careful, however narrow.
  void setRays(const Column& column, const Receivers& receivers, std::span<const std::uint32_t> members,
               bool inColumnFrame = false);
  /// The column's one line.
  void setLine();

 private:
  struct Start {
    double depth;
    std::uint32_t receiver;
  };
  void resize(std::size_t rays);
  std::vector<Start> starts_;
};

}  // namespace mote
