#include <fmt/format.h>

#include "host/octree/morton.h"
#include "host/octree/octree.h"

namespace mote {
namespace {

bool contains(const layout::Node& box, const vec3& centre, float radius) {
  // In double: the box must hold the support itself, not its rounded corners.
  for (int axis = 0; axis < 3; ++axis)
    if (double(centre[axis]) - double(radius) < double(box.lo[axis]) ||
        double(centre[axis]) + double(radius) > double(box.hi[axis]))
      return false;
  return true;
}

bool containsBox(const layout::Node& outer, const layout::Node& inner) {
  return glm::all(glm::lessThanEqual(outer.lo, inner.lo)) && glm::all(glm::greaterThanEqual(outer.hi, inner.hi));
}

std::string checkSource(const Octree& tree) {
  std::vector<bool> seen(tree.particleCount());
  for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) {
    const std::uint32_t i = tree.source[slot];
    if (i >= seen.size() || seen[i]) return fmt::format("slot {} holds particle {} out of range or twice", slot, i);
    seen[i] = true;
  }
  return "";
}

std::string checkMortonOrder(const Octree& tree) {
  Bounds bounds;
  for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) bounds.add(tree.position(slot));
  const MortonGrid grid(bounds);
  for (std::size_t slot = 1; slot < tree.particleCount(); ++slot)
    if (grid.code(tree.position(slot - 1)) > grid.code(tree.position(slot)))
      return fmt::format("slots {} and {} are not in Morton order", slot - 1, slot);
  return "";
}

/// Checks node `index` against its parent and its own children or particles.
std::string checkNode(const Octree& tree, std::size_t index, std::uint32_t particlesPerCell) {
  const layout::Node& node = tree.nodes[index];
  if (node.skip <= index || node.skip > tree.nodeCount())
    return fmt::format("node {} skips to {} of {}", index, node.skip, tree.nodeCount());
  const std::size_t end = tree.nodes[node.skip].first;
  if (node.first >= end) return fmt::format("node {} owns no particles: [{}, {})", index, node.first, end);
  for (std::size_t slot = node.first; slot < end; ++slot)
    if (!contains(node, tree.position(slot), tree.radius[slot]))
      return fmt::format("node {} does not bound the support of the particle in slot {}", index, slot);

  if (node.skip == index + 1) {  // a leaf: small, unless all its particles share one finest cell
    const vec3 a = tree.position(node.first), b = tree.position(end - 1);
    if (end - node.first > particlesPerCell && a != b) {
      Bounds all;
      for (std::size_t slot = 0; slot < tree.particleCount(); ++slot) all.add(tree.position(slot));
      const MortonGrid grid(all);
      if (grid.code(a) != grid.code(b))
        return fmt::format("leaf {} holds {} particles, more than {}", index, end - node.first, particlesPerCell);
    }
    return "";
  }
  int children = 0;
  std::size_t first = node.first;
  for (std::size_t child = index + 1; child < node.skip; child = tree.nodes[child].skip, ++children) {
    if (tree.nodes[child].first != first)
      return fmt::format("child {} of node {} starts at slot {}, not {}", child, index, tree.nodes[child].first, first);
    if (!containsBox(node, tree.nodes[child])) return fmt::format("node {} does not bound its child {}", index, child);
    if (tree.nodes[child].skip <= child) return fmt::format("node {} skips backwards", child);
    first = tree.nodes[tree.nodes[child].skip].first;
  }
  if (children < 2 || children > 8) return fmt::format("node {} has {} children", index, children);
  if (first != end) return fmt::format("the children of node {} end at slot {}, not {}", index, first, end);
  return "";
}

}  // namespace

std::string validate(const Octree& tree, std::uint32_t particlesPerCell) {
  if (tree.nodes.empty()) return "no sentinel node";
  const std::size_t count = tree.particleCount();
  for (const auto* array : {&tree.x, &tree.y, &tree.z, &tree.radius, &tree.peak})
    if (array->size() != count + kSlotPadding) return fmt::format("an array has {} entries", array->size());
  if (tree.nodes.back().first != count) return fmt::format("the sentinel starts at {}", tree.nodes.back().first);
  if (count == 0) return tree.nodes.size() == 1 ? "" : "nodes without particles";
  if (tree.nodeCount() == 0 || tree.nodes[0].first != 0 || tree.nodes[0].skip != tree.nodeCount())
    return "the root does not span the tree";
  if (std::string broken = checkSource(tree); !broken.empty()) return broken;
  if (std::string broken = checkMortonOrder(tree); !broken.empty()) return broken;
  for (std::size_t index = 0; index < tree.nodeCount(); ++index)
    if (std::string broken = checkNode(tree, index, particlesPerCell); !broken.empty()) return broken;
  return "";
}

}  // namespace mote
