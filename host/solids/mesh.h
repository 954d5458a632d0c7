// A solid's triangles in the scene, read from OBJ, PLY, STL, glTF, GLB and what else Assimp reads.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host/core/vec.h"
#include "host/scene/scene.h"
#include "shaders/glsl/layout/solid.h"

namespace mote {

struct Mesh {
  std::vector<vec3> position;  ///< of the corners [scene units]; corners at one place in the file are bit-equal here
  std::vector<vec3> normal;    ///< unit, at each position; 0 where the file has some but not here
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into `position`; finite, none without area

  Bounds bounds() const;
  layout::Triangle triangle(std::size_t k) const {
    const auto [a, b, c] = triangles[k];
    return {position[a], position[b], position[c]};
  }
};

/// Reads the file of `frame` (#### in the name), all of it or the solid's node, with the transforms of the nodes that
/// it stands under and then the solid's own: scale, rotate about x, y and z, translate. Polygons become triangles;
/// lines and points are passed over. Triangles without area or with a corner that is not finite are left out, with one
/// warning that counts them. A file without normals gets smooth ones, with its edges of more than 45° kept sharp.
/// Throws InputError for a missing file (with the nearest names), a file that is no mesh, and one without triangles.
Mesh loadMesh(const Solid& solid, int frame);

/// The meshes of all of them, in their order, each of its frame. Solids that follow each other with one file, as those of
/// an import do, have it read once.
std::vector<Mesh> loadMeshes(std::span<const Solid> solids, std::span<const int> frames);

}  // namespace mote
