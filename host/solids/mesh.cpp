#include "host/solids/mesh.h"

#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/scene/frame_path.h"
#include "host/scene/missing_file.h"

namespace mote {
namespace {

/// What was left out of a mesh.
struct LeftOut {
  std::size_t degenerate = 0, notFinite = 0;
};

dmat4 fromAssimp(const aiMatrix4x4& m) {  // Assimp's are rows, glm's columns
  return {m.a1, m.b1, m.c1, m.d1, m.a2, m.b2, m.c2, m.d2, m.a3, m.b3, m.c3, m.d3, m.a4, m.b4, m.c4, m.d4};
}

/// As for particle sources: scale, rotate about x, then y, then z, translate.
dmat4 sceneTransform(const Solid& solid) {
  dmat4 transform = glm::translate(dmat4(1), solid.translate);
  for (const int axis : {2, 1, 0}) {  // Rz · Ry · Rx: x is applied first
    dvec3 about(0);
    about[axis] = 1;
    transform = glm::rotate(transform, glm::radians(static_cast<double>(solid.rotate[axis])), about);
  }
  return glm::scale(transform, dvec3(solid.scale));
}

bool isFinite(const vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

bool hasArea(const layout::Triangle& t) {
  const dvec3 a(t.a);
  return glm::cross(dvec3(t.b) - a, dvec3(t.c) - a) != dvec3(0);
}

/// Normals go with the inverse transpose, so that they stay square to a surface that is stretched. A normal that the
/// file gives as nothing stays nothing.
vec3 transformedNormal(const glm::dmat3& cofactors, const aiVector3D& n) {
  const dvec3 normal = cofactors * dvec3(n.x, n.y, n.z);
  const double length = glm::length(normal);
  return length > 0 && std::isfinite(length) ? vec3(normal / length) : vec3(0);
}

/// Appends one of the file's meshes under `transform`.
void addMesh(const aiMesh& source, const dmat4& transform, Mesh& mesh, LeftOut& leftOut) {
  const std::size_t base = mesh.position.size();
  if (base + source.mNumVertices > std::numeric_limits<std::uint32_t>::max())
    throw MachineError(fmt::format("a mesh of more than {} vertices", std::numeric_limits<std::uint32_t>::max()));
  const glm::dmat3 cofactors = glm::transpose(glm::inverse(glm::dmat3(transform)));
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D& p = source.mVertices[i];
    mesh.position.emplace_back(transform * glm::dvec4(p.x, p.y, p.z, 1));
    mesh.normal.push_back(source.HasNormals() ? transformedNormal(cofactors, source.mNormals[i]) : vec3(0));
  }
  for (unsigned i = 0; i < source.mNumFaces; ++i) {
    const aiFace& face = source.mFaces[i];
    if (face.mNumIndices != 3) continue;  // a point or a line
    std::array<std::uint32_t, 3> corners{};
    bool finite = true;
    for (unsigned k = 0; k < 3; ++k) {
      corners[k] = static_cast<std::uint32_t>(base + face.mIndices[k]);
      finite = finite && isFinite(mesh.position[corners[k]]);
    }
    mesh.triangles.push_back(corners);
    const bool area = finite && hasArea(mesh.triangle(mesh.triangles.size() - 1));
    if (area) continue;
    mesh.triangles.pop_back();
    ++(finite ? leftOut.degenerate : leftOut.notFinite);
  }
}

bool hasNormals(const Mesh& mesh) {
  return std::any_of(mesh.normal.begin(), mesh.normal.end(), [](const vec3& normal) { return normal != vec3(0); });
}

/// Normals for a mesh that came without: at each corner the mean of those faces around it, weighted by their angles
/// there, that make less than 45° with the corner's own; what is sharper stays sharp. Splits the corners that triangles
/// share. (Assimp's own step rounds the edges of files whose faces share corners, PLY for one.)
void makeNormals(Mesh& mesh) {
  constexpr float kCreaseCosine = 0.70710678f;
  constexpr std::size_t kMostFaces = 512;  // around one corner; beyond that it stays flat, else time would be square
  const std::size_t count = 3 * mesh.triangles.size();
  std::vector<vec3> position(count), face(count);
  std::vector<float> angle(count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const layout::Triangle triangle = mesh.triangle(t);
    const dvec3 corners[] = {triangle.a, triangle.b, triangle.c};
    const vec3 normal(glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0])));
    for (std::size_t k = 0; k < 3; ++k) {
      const dvec3 to = glm::normalize(corners[(k + 1) % 3] - corners[k]);
      const dvec3 from = glm::normalize(corners[(k + 2) % 3] - corners[k]);
      position[3 * t + k] = vec3(corners[k]), face[3 * t + k] = normal;
      angle[3 * t + k] = static_cast<float>(std::acos(glm::clamp(glm::dot(to, from), -1.0, 1.0)));
    }
    const auto first = static_cast<std::uint32_t>(3 * t);
    mesh.triangles[t] = {first, first + 1, first + 2};
  }
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) { return std::tuple(position[i].x, position[i].y, position[i].z, i); };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  mesh.normal = face;
  for (std::size_t begin = 0, end; begin < count; begin = end) {
    for (end = begin + 1; end < count && position[order[end]] == position[order[begin]];) ++end;
    if (end - begin > kMostFaces) continue;
    for (std::size_t a = begin; a < end; ++a) {
      vec3 sum(0);
      for (std::size_t b = begin; b < end; ++b)
        if (glm::dot(face[order[a]], face[order[b]]) > kCreaseCosine) sum += angle[order[b]] * face[order[b]];
      if (glm::length(sum) > 0) mesh.normal[order[a]] = glm::normalize(sum);
    }
  }
  mesh.position = std::move(position);
}

void checkFile(const Solid& solid, const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) throw InputError(path, "", "a mesh", "a folder");
  if (!std::filesystem::exists(path, ignored))
    throw InputError(path, "", "a mesh", "no such file", nearestNames(solid.file, path));
}

/// A file as Assimp reads it, its nodes depth first.
class MeshFile {
 public:
  /// `solid` is the first that wants it: messages about a missing file name its pattern's frames.
  MeshFile(const Solid& solid, const std::string& path) : path_(path) {
    checkFile(solid, path);
    // What Mote does not read need not be carried along, nor split vertices.
    importer_.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                                 aiComponent_TEXCOORDS | aiComponent_COLORS | aiComponent_TANGENTS_AND_BITANGENTS |
                                     aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS | aiComponent_TEXTURES |
                                     aiComponent_LIGHTS | aiComponent_CAMERAS);
    scene_ = importer_.ReadFile(path, aiProcess_Triangulate | aiProcess_RemoveComponent);
    if (!scene_ || !scene_->mRootNode)
      throw InputError(path, "", "a mesh (OBJ, PLY, STL, glTF, GLB …)", importer_.GetErrorString());
    collect(*scene_->mRootNode, dmat4(1));
  }

  const std::string& path() const { return path_; }

  /// All of it, or the solid's node.
  Mesh meshOf(const Solid& solid) const {
    if (solid.node && *solid.node >= nodes_.size())
      throw InputError(path_, "", fmt::format("a node {} for the solid {}", *solid.node, solid.name),
                       fmt::format("{} nodes", nodes_.size()), "the file has changed since the scene was read");
    const std::size_t first = solid.node.value_or(0), last = solid.node ? first + 1 : nodes_.size();
    const dmat4 placed = sceneTransform(solid);
    Mesh mesh;
    LeftOut leftOut;
    for (std::size_t k = first; k < last; ++k) {
      const aiNode& node = *nodes_[k].node;
      for (unsigned i = 0; i < node.mNumMeshes; ++i)
        addMesh(*scene_->mMeshes[node.mMeshes[i]], placed * nodes_[k].world, mesh, leftOut);
    }
    finish(solid, leftOut, mesh);
    return mesh;
  }

 private:
  struct Node {
    const aiNode* node;
    dmat4 world;
  };

  void collect(const aiNode& node, const dmat4& parent) {
    const dmat4 world = parent * fromAssimp(node.mTransformation);
    nodes_.push_back({&node, world});
    for (unsigned i = 0; i < node.mNumChildren; ++i) collect(*node.mChildren[i], world);
  }

  void finish(const Solid& solid, const LeftOut& leftOut, Mesh& mesh) const {
    const std::string field = solid.node ? fmt::format("the mesh of {}", solid.name) : "";
    const std::string place = field.empty() ? path_ : fmt::format("{}: {}", path_, field);
    const std::size_t dropped = leftOut.degenerate + leftOut.notFinite;
    if (mesh.triangles.empty())
      throw InputError(place, "", "a mesh with triangles",
                       dropped == 0
                           ? "none"
                           : fmt::format("{} without area and {} not finite", leftOut.degenerate, leftOut.notFinite));
    if (dropped > 0)
      logWarning(fmt::format("{}: {} triangles without area and {} not finite were left out of {}", place,
                             leftOut.degenerate, leftOut.notFinite, dropped + mesh.triangles.size()));
    if (!hasNormals(mesh)) makeNormals(mesh);
  }

  std::string path_;
  Assimp::Importer importer_;
  const aiScene* scene_ = nullptr;  // the importer's
  std::vector<Node> nodes_;
};

}  // namespace

Bounds Mesh::bounds() const {
  Bounds bounds;
  for (const auto& corners : triangles)
    for (const std::uint32_t corner : corners) bounds.add(position[corner]);
  return bounds;
}

Mesh loadMesh(const Solid& solid, int frame) { return std::move(loadMeshes({&solid, 1}, {&frame, 1}).front()); }

std::vector<Mesh> loadMeshes(std::span<const Solid> solids, std::span<const int> frames) {
  std::vector<Mesh> meshes;
  std::optional<MeshFile> file;
  for (std::size_t k = 0; k < solids.size(); ++k) {
    const std::string path = framePath(solids[k].file, frames[k]);
    if (!file || file->path() != path) file.emplace(solids[k], path);
    meshes.push_back(file->meshOf(solids[k]));
  }
  return meshes;
}

}  // namespace mote
