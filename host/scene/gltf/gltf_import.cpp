#include "host/scene/gltf/gltf_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/core/log.h"
#include "host/scene/gltf/gltf_parts.h"
#include "host/scene/scene_parts.h"

namespace mote {
namespace {

constexpr std::string_view kOrientation = "_Orientation";

bool isFinite(const dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// What is read for all parts, but takes no harm when not understood; what would change meshes is refused.
void refuseUnreadMeshes(const GltfFile& file) {
  const GltfValue required = file.list("extensionsRequired");
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string name = required.item(i).text();
    for (const char* unread : {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression",
                               "KHR_mesh_quantization", "EXT_mesh_gpu_instancing"})
      if (name == unread)
        required.item(i).refuse("meshes without this extension", quotedForMessage(name),
                                R"(export without compression, or take no meshes: "solids": false)");
  }
}

/// The node's mesh has a primitive that makes triangles.
bool hasTriangles(const GltfValue& mesh) {
  const GltfValue primitives = mesh.member("primitives");
  for (std::size_t i = 0; i < primitives.size(); ++i)
    if (const std::uint64_t mode = primitives.item(i).member("mode").size64(4); mode >= 4 && mode <= 6) return true;
  return false;
}

/// The base colour of its first material, as shares; Mote's default where it has none.
vec3 albedoOf(const GltfFile& file, const GltfValue& mesh) {
  const GltfValue primitives = mesh.member("primitives"), materials = file.list("materials");
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    const GltfValue material = primitives.item(i).member("material");
    if (!material) continue;
    double rgba[4] = {1, 1, 1, 1};
    materials.item(material.index(materials.size(), "materials"))
        .member("pbrMetallicRoughness")
        .member("baseColorFactor")
        .numbers(rgba, 4);
    return vec3(glm::clamp(dvec3(rgba[0], rgba[1], rgba[2]), 0.0, 1.0));
  }
  return Solid{}.albedo;
}

/// Nothing is left of a triangle under it.
bool isFlatToALine(const dmat4& world) {
  const dvec3 x(world[0]), y(world[1]), z(world[2]), none(0);
  return glm::cross(x, y) == none && glm::cross(y, z) == none && glm::cross(z, x) == none;
}

void requireFinite(const GltfNode& node, const GltfValue& value) {
  for (int column = 0; column < 4; ++column)
    if (const dvec3 v(node.world[column]); !isFinite(v) || glm::any(glm::greaterThan(glm::abs(v), dvec3(kMaxLength))))
      value.refuse(fmt::format("a place in the world within ±{}", kMaxLength),
                   fmt::format("[{}, {}, {}] in its transform", v.x, v.y, v.z));
}

}  // namespace

std::string userName(const GltfNode& node) {
  const bool wrapped = node.name.ends_with(kOrientation) && node.name.size() > kOrientation.size();
  return wrapped ? node.name.substr(0, node.name.size() - kOrientation.size()) : node.name;
}

std::string SceneNames::take(const std::string& name, const std::string& fallback) {
  std::string base;
  for (const char c : name.substr(0, kMaxNameLength)) {
    const bool letter = (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_', digit = c >= '0' && c <= '9';
    if (digit && base.empty()) base += '_';
    base += letter || digit ? c : '_';
  }
  if (base.empty()) base = fallback;
  base.resize(std::min(base.size(), kMaxNameLength));
  std::string unique = base;
  for (std::size_t& n = last_[base]; !taken_.insert(unique).second;) {
    const std::string number = fmt::format("_{}", n = std::max<std::size_t>(n + 1, 2));
    unique = base.substr(0, kMaxNameLength - number.size()) + number;
  }
  return unique;
}

GltfFrame frameOf(const dmat4& world, const GltfValue& value, const std::string& when) {
  const dvec3 position(world[3]), back(world[2]), up(world[1]);
  const bool placed = isFinite(position) && glm::all(glm::lessThanEqual(glm::abs(position), dvec3(kMaxLength)));
  const dvec3 forward = -glm::normalize(back), upright = glm::normalize(up - glm::dot(up, forward) * forward);
  if (!placed || !isFinite(forward) || !isFinite(upright))
    value.refuse(fmt::format("a node that can be looked along{}", when),
                 placed ? "a transform that squeezes its axes to nothing, or is not finite" : "a place beyond 1e18");
  return {position, forward, upright};
}

void importSolids(const GltfShot& gltf, ImportedShot& shot) {
  const GltfValue meshes = gltf.file.list("meshes");
  SceneNames names;
  for (const std::size_t i : gltf.nodes.inScene) {
    const GltfValue value = gltf.value(i), index = value.member("mesh");
    if (!index) continue;
    if (shot.solids.empty()) refuseUnreadMeshes(gltf.file);
    const GltfNode& node = gltf.nodes.all[i];
    const GltfValue mesh = meshes.item(index.index(meshes.size(), "meshes"));
    const auto warn = [&](const char* what) {
      logWarning(fmt::format("{}: {}: {} {}", gltf.file.path(), value.pointer(), quotedForMessage(node.name), what));
    };
    requireFinite(node, value);
    if (!hasTriangles(mesh) || isFlatToALine(node.world)) {
      warn(hasTriangles(mesh) ? "is left out: its scale leaves nothing of it"
                              : "is left out: its mesh has no triangles");
      continue;
    }
    if (value.member("skin")) warn("stands as it was modelled: skeletons are not read");
    if (gltf.animations.moves(i)) warn("stands still: only cameras move");
    Solid solid;
    solid.pointer = fmt::format("{}: {}", gltf.file.path(), value.pointer());
    solid.name = names.take(node.name, fmt::format("node{}", i));
    solid.file = gltf.options.file;
    solid.node = node.place;
    solid.albedo = albedoOf(gltf.file, mesh);
    shot.solids.push_back(std::move(solid));
  }
}

ImportedShot importGltf(const ImportOptions& options) {
  const GltfFile file(options.file);
  const GltfNodes nodes = readGltfNodes(file);
  GltfAnimations animations(file, nodes);
  const GltfShot gltf{options, file, nodes, animations};
  ImportedShot shot;
  shot.files = {options.file};
  if (options.camera) importCamera(gltf, shot);
  if (options.lights) importLights(gltf, shot);
  if (options.solids) importSolids(gltf, shot);
  const bool keys = shot.camera && !shot.camera->keys.empty();
  if (keys || !shot.solids.empty())
    for (std::string& buffer : file.bufferFiles()) shot.files.push_back(std::move(buffer));
  return shot;
}

}  // namespace mote
