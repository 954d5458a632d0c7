// Level of detail: one stand-in particle for all that lie in a node of the octree, wherever a bound known beforehand
// allows it.
//
// A stand-in has the mass, the centroid and the variance of what it stands for, with the falloff of every particle:
// R² = mean r² + spread / (3 · variance of the falloff along an axis); its peak is mass / R². What stands in depends on
// the tree, the tolerance and the density alone, so a coarser tree of stand-ins and of the particles that nothing
// stands in for is made once, for all lights of one shadow density; the exact sums, on the host or on a device, go
// through it as through any other. A ray's own particle may be in a stand-in, wherever the ray starts; what it adds
// where it stands is known (½ of its peak) and taken off the sum.
//
// The bound. Let D(x) be what a stand-in adds to the ray that passes at x, less what its particles add, and κ the
// factor on optical depth (shadowDensity · extinction). All masses agree, so ∫ D dA = 0: across rays spread evenly over
// the stand-in the error is as often above as below. Its size follows from a Taylor series about the centroid and the
// mean r². The terms of the first order vanish by the choice of both, and
//
//   √∫ D² dA ≤ v · M / (√π · r),   v = c · xᵖ / (1 + s · xᵖ),   √x = (√spread + 0.7 · √areaSpread / r) / r
//
// with r the least radius and M the mass [scene units²]. c, p and s (errorLaw in the .cpp) are such that v is above
// the greatest value over all directions of the spread, places of a ray's start and endpoint rules, by quadrature. A
// ray crosses stand-ins each at an independent place, so the squares of their errors add up. With
//
//   κ · M / (π r²) · v² ≤ δ²        for each of them                                                       (1)
//
// the mean square of κΔτ is, over the cross-section, at most δ² times the mean of κτ: where little lies in the way a
// stand-in may be as wide as it likes, and where the medium is dense it must be narrow. Then |κΔτ| ≤ δ · √(κτ) in the
// mean and |ΔT| ≤ δ · √(κτ) · e^−κτ ≤ δ / √(2e), whatever τ is. So
//
//   δ = √(2e) · tolerance   gives   mean |ΔT| ≤ tolerance.
//
// It takes for granted that rays lie evenly over a stand-in and that errors of different ones have nothing in common;
// on a lattice along the light they have. Clouds and plumes stay below by a factor of 5 to 30, for v is the worst case
// and most rays are not at the worst optical depth.
//
// It pays where many particles overlap (docs/performance.md). With three channels there is a stand-in for each, as
// their masses lie differently.
#pragma once
#include <functional>

#include "host/lighting/lighting.h"
#include "host/octree/node_sums.h"

namespace mote {

struct DetailRules {
  double tolerance = 0;  ///< mean |ΔT|, ≥ 0; 0: nothing stands in
  double density = 1;    ///< κ, ≥ 0: the greatest factor on an optical depth
  layout::uint falloff = layout::kFalloffSmooth;
};
DetailRules detailRules(const layout::Light& light, const LightingOptions& options, double tolerance);

/// What is measured is below the tolerance by about so much, or more: where to begin a search that measures.
constexpr double kDetailMargin = 5;

/// v of the bound above for what the sums are of; its mass must not be 0.
double standInError(const NodeSums& sums, layout::uint falloff);
/// R of the stand-in [scene units].
double standInRadius(const NodeSums& sums, layout::uint falloff);

/// What a coarser tree would hold and cost, without making it. Core-µs are those of AVX-512; only ratios matter.
struct DetailCost {
  double particles = 0;  ///< in the coarser tree
  double build = 0;      ///< core-µs a particle of the exact tree, once for all lights
  double light = 0;      ///< core-µs a receiver and light
};
/// Tolerance 0 gives what exact sums cost. O(nodes), 0.005 core-µs a particle. `particles` and `light` are within a
/// factor of two of what is found, and of a quarter where much is left out.
DetailCost detailCost(const Octree& tree, const TreeSums& sums, const DetailRules& rules);

class DetailTree {
 public:
  /// `tree` must outlive it; `sums` are its nodeSums. Leaves that no stand-in may take whole are halved on. With three
  /// channels there is one stand-in a colour. The same tree on any number of threads. 0.01 to 0.2 core-µs a particle,
  /// 4 bytes a particle and an octree of what is left.
  DetailTree(const Octree& tree, const TreeSums& sums, const DetailRules& rules);

  /// The coarser one, or the exact one where nothing stands in.
  const Octree& tree() const { return standIns_ > 0 ? coarse_ : *exact_; }
  /// Groups of particles that something stands in for.
  std::size_t standIns() const { return standIns_; }

  /// For each receiver the slot of tree() that it leaves out, or kNoSlot.
  std::vector<std::uint32_t> selves(const Receivers& receivers) const;
  /// Options for sums that takeOwn is still to be taken off: with a cutoff as much lower.
  LightingOptions optionsFor(const layout::Light& light, const LightingOptions& options) const;
  /// Takes what each receiver's own particle adds off where a stand-in holds it: `depths` [channel][receiver].
  void takeOwn(const Receivers& receivers, const layout::Light& light, const LightingOptions& options,
               std::span<const std::uint8_t> reached, std::vector<float>& depths) const;

 private:
  const Octree* exact_;
  Octree coarse_;
  std::vector<std::uint32_t> slot_;  ///< slot of the exact tree → slot of the coarser one, or kNoSlot: in a stand-in
  std::size_t standIns_ = 0;
  float greatestPeak_ = 0;  ///< of particles in stand-ins
};

/// Sums over the tree of a DetailTree: mote::opticalDepths, or a device's that has been given that tree.
using DetailSums =
    std::function<std::vector<float>(const Octree&, const Receivers&, const layout::Light&, const LightingOptions&,
                                     std::span<const std::uint8_t> reached, const RaysDone&)>;

/// As opticalDepths, with stand-ins; `receivers` leave slots of the exact tree out. Without any stand-in the bits of
/// the exact sums. The same bits on any number of threads and any instruction set. 4 bytes a receiver beside the
/// result.
std::vector<float> lodOpticalDepths(const DetailTree& detail, const Receivers& receivers, const layout::Light& light,
                                    const LightingOptions& options, std::span<const std::uint8_t> reached = {},
                                    const RaysDone& done = {});
std::vector<float> lodOpticalDepths(const DetailTree& detail, const Receivers& receivers, const layout::Light& light,
                                    const LightingOptions& options, const DetailSums& sums,
                                    std::span<const std::uint8_t> reached = {}, const RaysDone& done = {});

}  // namespace mote
