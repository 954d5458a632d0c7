// A bounding volume hierarchy over the triangles that cast shadows (thesis §4.4), flattened as the octree is: depth
// first, with skip links (DESIGN §4, shaders/glsl/layout/node.h). Embree chooses the splits (binary, surface area
// heuristic).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/core/vec.h"
#include "host/solids/mesh.h"
#include "shaders/glsl/layout/node.h"
#include "shaders/glsl/layout/solid.h"

namespace mote {

struct SolidTree {
  std::vector<layout::Node> nodes;          ///< depth first; the last is the sentinel
  std::vector<layout::Triangle> triangles;  ///< in leaf order: a node's are [first, nodes[skip].first)
  std::vector<std::uint32_t> source;        ///< leaf order → index in what buildSolidTree was given

  std::size_t nodeCount() const { return nodes.empty() ? 0 : nodes.size() - 1; }
  bool empty() const { return triangles.empty(); }
  Bounds bounds() const { return empty() ? Bounds{} : Bounds{nodes[0].lo, nodes[0].hi}; }
};

/// Triangles of all solids that cast shadows, solid after solid; meshes[k] is that of solids[k]. Hidden solids and
/// holdouts cast as well.
std::vector<layout::Triangle> shadowTriangles(std::span<const Solid> solids, std::span<const Mesh> meshes);

/// Builds the tree of finite triangles, up to 2³² − 2; none give a tree that is in nobody's way. One thread builds it,
/// so that it is a function of the triangles alone: 1 s a million. Throws MachineError where memory ends.
SolidTree buildSolidTree(std::span<const layout::Triangle> triangles);

/// Checks every promise of the layout: each triangle once, skip links, ranges, boxes that hold their triangles with
/// room to spare and nest, no empty leaves. Returns the first that is broken as a sentence, or "".
std::string validate(const SolidTree& tree);

}  // namespace mote
