// The nodes of a glTF's scene: who stands under whom, and where each is in the world.
//
// Source: glTF 2.0 Specification, §3.5 "Scenes".
#pragma once
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/scene/gltf/gltf_file.h"

namespace mote {

/// Scale, then rotation, then translation.
struct GltfPose {
  dvec3 translation{0}, scale{1};
  glm::dquat rotation{1, 0, 0, 0};  // w, x, y, z; unit length

  dmat4 matrix() const;
};

struct GltfNode {
  std::string name;                 ///< "" where it has none
  std::optional<std::size_t> over;  ///< the node that it stands under; none: a root
  GltfPose pose;                    ///< at rest
  std::optional<dmat4> matrix;      ///< instead of a pose
  dmat4 world{1};                   ///< at rest, those above it included; of nodes of the scene only
  std::uint32_t place = 0;          ///< as Solid::node counts; of nodes of the scene only

  dmat4 local() const { return matrix ? *matrix : pose.matrix(); }
};

/// Deeper trees are refused: no rig is, and other readers of the file recurse.
constexpr std::size_t kMaxGltfDepth = 500;

struct GltfNodes {
  std::vector<GltfNode> all;         ///< by their number in the file
  std::vector<std::size_t> inScene;  ///< those of the scene ("scene", else the first), depth first

  GltfValue value(const GltfFile& file, std::size_t node) const { return file.list("nodes").item(node); }
};

/// Throws InputError for indices out of range, nodes with two parents or in a circle, depths beyond kMaxGltfDepth,
/// a file without a scene, and numbers that are not what they should be.
GltfNodes readGltfNodes(const GltfFile& file);

}  // namespace mote
