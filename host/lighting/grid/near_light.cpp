#include "host/lighting/grid/near_light.h"

#include <algorithm>
#include <cmath>

#include "host/core/cap.h"
#include "host/core/falloff.h"
#include "host/lighting/exact/beam_kernel.h"

namespace mote {
namespace {

/// Whether the support of a particle may touch what planes enclose.
bool touches(const ColumnPlanes& planes, const vec3& position, float radius) {
  const vec3 p = position - planes.origin;
  for (std::size_t k = 0; k < kColumnPlanes; ++k)
    if (p.x * planes.x[k] + p.y * planes.y[k] + p.z * planes.z[k] - planes.offset[k] > radius) return false;
  return true;
}

void addOne(const Octree& tree, std::uint32_t slot, const dvec3& light, const Receivers& receivers,
            std::span<const std::uint32_t> members, const LightingOptions& options, std::vector<float>& depths) {
  const vec3 centre(dvec3(tree.position(slot)) - light);
  const float radius = tree.radius[slot], inverseSquare = inverseSquareOf(radius);
  const std::vector<float>* peaks[] = {&tree.peak, &tree.peakGreen, &tree.peakBlue};
  const std::size_t count = members.size();
  for (std::size_t k = 0; k < count; ++k) {
    if (receivers.selfOf(members[k]) == slot) continue;
    const vec3 offset(dvec3(receivers.position(members[k])) - light);
    const float length = glm::length(offset);
    const vec3 direction = offset / length;
    const float fromLight = glm::dot(centre, direction);
    const float s = options.endpoint == layout::kEndpointClamp ? std::clamp(fromLight, 0.0f, length) : fromLight;
    const vec3 across = centre - s * direction;
    const float q = glm::dot(across, across) * inverseSquare;
    if (q >= 1) continue;
    float share = falloff(q, options.falloff);
    if (options.endpoint == layout::kEndpointSoft) {
      const float halfChord = radius * std::sqrt(1 - q);
      share *= cap(length - fromLight, halfChord) * cap(fromLight, halfChord);
    }
    for (std::size_t c = 0; c < tree.channels(); ++c) depths[c * count + k] += (*peaks[c])[slot] * share;
  }
}

/// Planes around the rays of a tile's receivers.
ColumnPlanes planesOf(const GridShape& shape, const TilePlace& place, const Receivers& receivers,
                      std::span<const std::uint32_t> members, float slack) {
  const LightFrame& frame = shape.faces[place.face];
  double deepest = 0;
  for (const std::uint32_t k : members)
    deepest = std::max(deepest, glm::distance(dvec3(receivers.position(k)), frame.origin));
  const dvec2 corner = dvec2(place.column, place.row) * double(shape.tileCells);
  const dvec2 end = corner + double(shape.tileCells);
  return planesAround(frame, corner * shape.resolution.cell, end * shape.resolution.cell, deepest, slack);
}

}  // namespace

void addNearLight(const Octree& tree, std::span<const std::uint32_t> nearLight, const GridShape& shape,
                  const TilePlace& place, const Receivers& receivers, std::span<const std::uint32_t> members,
                  const LightingOptions& options, float slack, std::vector<float>& depths) {
  if (nearLight.empty()) return;
  const ColumnPlanes planes = planesOf(shape, place, receivers, members, slack);
  const dvec3 light = shape.faces[place.face].origin;
  for (const std::uint32_t slot : nearLight)
    if (touches(planes, tree.position(slot), tree.radius[slot]))
      addOne(tree, slot, light, receivers, members, options, depths);
}

}  // namespace mote
