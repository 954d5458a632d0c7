#include "host/solids/solid_tree.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "host/core/error.h"
#include "host/solids/embree.h"

namespace mote {
namespace {

/// Small leaves: the triangle test costs three box tests, and any-hit walks rarely need more than one leaf.
constexpr unsigned kLeafSize = 4;

/// A node as Embree's builder makes it: two children, or the triangles of a leaf.
struct BuildNode {
  BuildNode* children[2] = {};
  std::vector<std::uint32_t> triangles;
};

/// Where the builder's callbacks put their nodes. One thread builds, so no lock is needed.
struct BuildNodes {
  std::deque<BuildNode> nodes;
};

void* createNode(RTCThreadLocalAllocator, unsigned, void* user) {
  return &static_cast<BuildNodes*>(user)->nodes.emplace_back();
}

void setChildren(void* node, void** children, unsigned count, void*) {
  for (unsigned k = 0; k < count; ++k)
    static_cast<BuildNode*>(node)->children[k] = static_cast<BuildNode*>(children[k]);
}

void setBounds(void*, const RTCBounds**, unsigned, void*) {}  // taken from the triangles when flattening

void* createLeaf(RTCThreadLocalAllocator, const RTCBuildPrimitive* primitives, std::size_t count, void* user) {
  BuildNode& leaf = static_cast<BuildNodes*>(user)->nodes.emplace_back();
  for (std::size_t k = 0; k < count; ++k) leaf.triangles.push_back(primitives[k].primID);
  std::sort(leaf.triangles.begin(), leaf.triangles.end());
  return &leaf;
}

Bounds boundsOf(const layout::Triangle& triangle) {
  Bounds bounds;
  for (const vec3& corner : {triangle.a, triangle.b, triangle.c}) bounds.add(corner);
  return bounds;
}

const BuildNode* buildNodes(std::span<const layout::Triangle> triangles, BuildNodes& nodes) {
  std::vector<RTCBuildPrimitive> primitives(triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const auto [lo, hi] = boundsOf(triangles[k]);
    primitives[k] = {lo.x, lo.y, lo.z, 0, hi.x, hi.y, hi.z, static_cast<unsigned>(k)};
  }
  const embree::Device device = embree::makeDevice();
  const embree::Bvh bvh(rtcNewBVH(device.get()));
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.bvh = bvh.get();
  arguments.maxLeafSize = kLeafSize;
  arguments.primitives = primitives.data();
  arguments.primitiveCount = primitives.size();
  arguments.primitiveArrayCapacity = primitives.size();
  arguments.createNode = createNode;
  arguments.setNodeChildren = setChildren;
  arguments.setNodeBounds = setBounds;
  arguments.createLeaf = createLeaf;
  arguments.userPtr = &nodes;
  const auto* root = static_cast<const BuildNode*>(tbb::task_arena(1).execute([&] { return rtcBuildBVH(&arguments); }));
  embree::check(device.get(), "building the tree of solids");
  return root;
}

/// Appends the subtree to the tree; boxes one float step outwards.
Bounds flatten(const BuildNode& node, std::span<const layout::Triangle> triangles, SolidTree& tree) {
  const std::size_t self = tree.nodes.size(), first = tree.triangles.size();
  tree.nodes.emplace_back();
  Bounds bounds;
  for (const std::uint32_t k : node.triangles) {
    bounds.add(boundsOf(triangles[k]));
    tree.triangles.push_back(triangles[k]);
    tree.source.push_back(k);
  }
  if (!node.triangles.empty()) {
    for (int axis = 0; axis < 3; ++axis) {
      bounds.lo[axis] = std::nextafter(bounds.lo[axis], -std::numeric_limits<float>::infinity());
      bounds.hi[axis] = std::nextafter(bounds.hi[axis], std::numeric_limits<float>::infinity());
    }
  }
  for (const BuildNode* child : node.children)
    if (child) bounds.add(flatten(*child, triangles, tree));
  tree.nodes[self] = {bounds.lo, static_cast<layout::uint>(first), bounds.hi,
                      static_cast<layout::uint>(tree.nodes.size())};
  return bounds;
}

/// A sentence about what is wrong with one node, or "".
std::string checkNode(const SolidTree& tree, std::size_t index) {
  const layout::Node& node = tree.nodes[index];
  if (node.skip <= index || node.skip > tree.nodeCount())
    return fmt::format("node {} skips to {} of {}", index, node.skip, tree.nodeCount());
  const std::size_t end = tree.nodes[node.skip].first;
  if (node.first >= end) return fmt::format("node {} owns no triangles: [{}, {})", index, node.first, end);
  for (std::size_t slot = node.first; slot < end; ++slot) {
    const auto [lo, hi] = boundsOf(tree.triangles[slot]);
    if (!glm::all(glm::lessThan(node.lo, lo)) || !glm::all(glm::greaterThan(node.hi, hi)))
      return fmt::format("node {} does not hold triangle {} with a float step to spare", index, slot);
  }
  std::size_t expected = node.first;
  for (std::size_t child = index + 1; child < node.skip; child = tree.nodes[child].skip) {
    const layout::Node& inner = tree.nodes[child];
    if (inner.skip <= child || inner.skip > node.skip)
      return fmt::format("node {} reaches out of its parent {}", child, index);
    if (inner.first != expected) return fmt::format("node {} does not begin where its sibling ends", child);
    if (!glm::all(glm::lessThanEqual(node.lo, inner.lo)) || !glm::all(glm::greaterThanEqual(node.hi, inner.hi)))
      return fmt::format("node {} is not inside its parent {}", child, index);
    expected = tree.nodes[inner.skip].first;
  }
  return node.skip > index + 1 && expected != end ? fmt::format("the children of node {} leave triangles out", index)
                                                  : "";
}

}  // namespace

std::vector<layout::Triangle> shadowTriangles(std::span<const Solid> solids, std::span<const Mesh> meshes) {
  MOTE_CHECK(solids.size(), ==, meshes.size());
  std::vector<layout::Triangle> triangles;
  for (std::size_t k = 0; k < solids.size(); ++k)
    if (solids[k].castsShadows)
      for (std::size_t i = 0; i < meshes[k].triangles.size(); ++i) triangles.push_back(meshes[k].triangle(i));
  return triangles;
}

SolidTree buildSolidTree(std::span<const layout::Triangle> triangles) {
  if (triangles.size() > 0xfffffffeull)
    throw MachineError(fmt::format("{} triangles cast shadows: Mote numbers them with 32 bits, so at most 4294967294",
                                   triangles.size()));
  SolidTree tree;
  if (!triangles.empty()) {
    BuildNodes nodes;
    const BuildNode* root = buildNodes(triangles, nodes);
    tree.triangles.reserve(triangles.size());
    tree.source.reserve(triangles.size());
    tree.nodes.reserve(nodes.nodes.size() + 1);
    flatten(*root, triangles, tree);
  }
  tree.nodes.push_back({vec3(std::numeric_limits<float>::infinity()), static_cast<layout::uint>(triangles.size()),
                        vec3(-std::numeric_limits<float>::infinity()),
                        static_cast<layout::uint>(tree.nodes.size() + 1)});
  return tree;
}

std::string validate(const SolidTree& tree) {
  if (tree.nodes.empty()) return "there is no sentinel";
  if (tree.source.size() != tree.triangles.size()) return "source and triangles differ in length";
  if (tree.nodes.back().first != tree.triangles.size()) return "the sentinel does not count the triangles";
  std::vector<bool> seen(tree.source.size());
  for (const std::uint32_t k : tree.source) {
    if (k >= seen.size() || seen[k]) return fmt::format("triangle {} is out of range or twice in the tree", k);
    seen[k] = true;
  }
  if (tree.nodeCount() > 0 && (tree.nodes[0].first != 0 || tree.nodes[0].skip != tree.nodeCount()))
    return "the root is not the whole tree";
  for (std::size_t index = 0; index < tree.nodeCount(); ++index)
    if (std::string broken = checkNode(tree, index); !broken.empty()) return broken;
  return "";
}

}  // namespace mote
