#include "host/scene/gltf/gltf_nodes.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace mote {
namespace {

glm::dquat unitQuaternion(const GltfValue& value) {
  std::array<double, 4> xyzw{0, 0, 0, 1};
  if (!value.numbers(xyzw.data(), 4)) return {1, 0, 0, 0};
  const glm::dquat rotation(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  const double length = glm::length(rotation);
  if (!(length > 0 && std::isfinite(length))) value.refuse("a rotation that is not zero", "[0, 0, 0, 0]");
  return rotation / length;
}

GltfNode readNode(const GltfValue& value) {
  GltfNode node;
  node.name = value.member("name").text();
  value.member("translation").numbers(&node.pose.translation.x, 3);
  value.member("scale").numbers(&node.pose.scale.x, 3);
  node.pose.rotation = unitQuaternion(value.member("rotation"));
  dmat4 matrix(1);
  if (value.member("matrix").numbers(&matrix[0][0], 16)) node.matrix = matrix;  // columns, as glm's
  return node;
}

/// Who stands under whom: each under one at most.
void link(const GltfValue& list, std::vector<GltfNode>& nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const GltfValue children = list.item(i).member("children");
    for (std::size_t k = 0; k < children.size(); ++k) {
      const std::size_t child = children.item(k).index(nodes.size(), "nodes");
      if (nodes[child].over)
        children.item(k).refuse("a node that stands under no other",
                                fmt::format("node {}, which stands under node {}", child, *nodes[child].over));
      nodes[child].over = i;
    }
  }
}

/// Every node hangs from a root by at most kMaxGltfDepth steps.
void requireTrees(const GltfValue& list, const std::vector<GltfNode>& nodes) {
  std::vector<std::size_t> depth(nodes.size(), 0);  // 0: not known yet
  std::vector<std::size_t> way;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    way.clear();
    std::optional<std::size_t> at = i;
    for (; at && depth[*at] == 0; at = nodes[*at].over) {
      if (way.size() > nodes.size()) list.item(i).refuse("nodes that make trees", "one that stands under itself");
      way.push_back(*at);
    }
    std::size_t above = at ? depth[*at] : 0;
    for (; !way.empty(); way.pop_back()) depth[way.back()] = ++above;
    if (above > kMaxGltfDepth)
      list.item(i).refuse(fmt::format("at most {} nodes under each other", kMaxGltfDepth), "more");
  }
}

/// The scene's nodes, depth first, each with its world transform and place.
void walkScene(const GltfFile& file, const GltfValue& list, GltfNodes& nodes) {
  const GltfValue scenes = file.list("scenes"), chosen = file.list("scene");
  if (scenes.size() == 0) scenes.refuse("a scene", "none");
  const GltfValue roots = scenes.item(chosen ? chosen.index(scenes.size(), "scenes") : 0).member("nodes");
  std::vector<std::size_t> open;
  std::vector<bool> listed(nodes.all.size(), false);
  for (std::size_t k = roots.size(); k-- > 0;) {
    const std::size_t root = roots.item(k).index(nodes.all.size(), "nodes");
    if (nodes.all[root].over) roots.item(k).refuse("a node that stands under no other", fmt::format("node {}", root));
    if (listed[root]) roots.item(k).refuse("each node once", fmt::format("node {} again", root));
    listed[root] = true;
    open.push_back(root);
  }
  // Where there are several roots Assimp puts one node above them.
  std::uint32_t place = roots.size() == 1 ? 0 : 1;
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    GltfNode& node = nodes.all[at];
    node.world = node.over ? nodes.all[*node.over].world * node.local() : node.local();
    node.place = place++;
    nodes.inScene.push_back(at);
    const GltfValue children = list.item(at).member("children");
    for (std::size_t k = children.size(); k-- > 0;) open.push_back(children.item(k).index(nodes.all.size(), "nodes"));
  }
}

}  // namespace

dmat4 GltfPose::matrix() const {
  return glm::scale(glm::translate(dmat4(1), translation) * glm::mat4_cast(rotation), scale);
}

GltfNodes readGltfNodes(const GltfFile& file) {
  const GltfValue list = file.list("nodes");
  GltfNodes nodes;
  nodes.all.reserve(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) nodes.all.push_back(readNode(list.item(i)));
  link(list, nodes.all);
  requireTrees(list, nodes.all);
  walkScene(file, list, nodes);
  return nodes;
}

}  // namespace mote
