// Rays toward one light in bundles that share their way: what is found for a bundle once serves all of its rays.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "host/lighting/receivers.h"
#include "shaders/glsl/layout/light.h"

namespace mote {

/// Most rays of a column of beams, and of a beam (a quarter more where they are cut unevenly). What lies in a column's
/// way is found once for all of its rays, and each beam chooses from it: wide enough that finding costs little, narrow
/// enough that little of what is chosen misses a ray. The numbers are those for TBB.
struct BeamLimits {
  std::size_t columnRays = 4096, beamRays = 256;
};

/// Receivers, grouped.
struct Beams {
  std::vector<std::uint32_t> receiver;  ///< each that is reached, once; none that stands at the light itself
  std::vector<std::uint32_t> start;     ///< beam b has receiver[start[b] … start[b + 1])
  std::vector<std::uint32_t> column;    ///< column c has the beams column[c] … column[c + 1]

  std::size_t columns() const { return column.empty() ? 0 : column.size() - 1; }
  std::span<const std::uint32_t> ofBeam(std::size_t b) const { return between(start[b], start[b + 1]); }
  std::span<const std::uint32_t> ofColumn(std::size_t c) const {
    return between(start[column[c]], start[column[c + 1]]);
  }

 private:
  std::span<const std::uint32_t> between(std::size_t begin, std::size_t end) const {
    return std::span(receiver).subspan(begin, end - begin);
  }
};

/// Groups the receivers whose `reached` is not 0 (empty: all) by where their rays cross the plane of a directional
/// light, or one of the six faces of a cube around a point light. Halves of equal count, across the wider side, until a
/// column has at most columnRays rays and a beam at most beamRays, and neither is wider than a few times
/// `typicalRadius` [scene units] (or they have one ray): wider ones would find far more than their rays meet. None of a
/// point light is wider than a face. The result depends on nothing but the arguments. About 15 ms per million on two
/// cores; 16 bytes a ray while it runs.
Beams planBeams(const Receivers& receivers, const layout::Light& light, std::span<const std::uint8_t> reached,
                double typicalRadius, const BeamLimits& limits = {});

}  // namespace mote
