// What the camera sees of solids: for each pixel up to three surfaces, each with the share of the pixel that it covers
// (true coverage by 64 rays, off by 0.01 in the mean), its depth, and a point that can be lit.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host/scene/scene.h"
#include "host/solids/mesh.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

constexpr int kSurfaceRays = 16;    ///< a pixel, at fixed places …
constexpr int kEdgeRays = 64;       ///< … and where those do not all meet one surface: coverage in steps of 1/64
constexpr int kSurfaceClasses = 4;  ///< surfaces of one pixel and what is beside them, together
constexpr int kShadowPoints = 4;    ///< of one surface in a pixel: the edges of solids' shadows are smoothed with them

/// One surface in one pixel.
struct Surface {
  std::uint32_t pixel;                     ///< y · width + x
  std::uint16_t solid;                     ///< index into the scene's solids
  std::uint16_t shadowPoints;              ///< 1 … kShadowPoints
  float coverage;                          ///< share of the pixel, 0 < coverage ≤ 1
  float depth;                             ///< along the view axis, mean [scene units]
  vec3 normal;                             ///< unit, of the side that faces the camera; smooth where the mesh is
  std::array<vec3, kShadowPoints> points;  ///< beside the surface, where shadow rays may start; the first is lit
};

/// Every surface of the picture, in the order of pixels; within a pixel from the greatest coverage on.
struct Surfaces {
  int width = 0, height = 0;
  std::vector<Surface> all;
  std::vector<std::uint32_t> first;  ///< a pixel's surfaces are all[first[p]] … all[first[p + 1] − 1]

  bool empty() const { return all.empty(); }
  /// Drawings that are needed so that each surface, and what is beside them all, is met once: 1 … kSurfaceClasses.
  int drawings() const;
  /// What drawing `k` meets at a pixel: a surface, or nullptr. `coverage` is its share, also of what is beside them; 0
  /// where the drawing leaves the pixel out.
  const Surface* at(std::size_t pixel, int k, float& coverage) const;
  /// The surfaces' depths for drawing `k`, as rasterizeFull takes them.
  std::vector<float> depths(int k) const;
};

/// Casts the rays with Embree. meshes[k] is that of solids[k]; hidden ones are not seen. Surfaces are seen from near to
/// far of the camera, sharp and at the frame's time whatever lens and shutter are. Rays of one pixel belong to one
/// surface where they meet the same solid in about one plane; more than three surfaces become three, the smallest
/// joining the nearest of the same mode. About 1 µs a ray on one core. Does not depend on the number of threads.
Surfaces traceSurfaces(std::span<const Solid> solids, std::span<const Mesh> meshes, const layout::SplatCamera& camera);

}  // namespace mote
