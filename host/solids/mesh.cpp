#include "host/solids/mesh.h"

#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

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
  dmat4 transform = glm::translate(dmat4(1), dvec3(solid.translate));
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

void addNode(const aiScene& scene, const aiNode& node, const dmat4& parent, Mesh& mesh, LeftOut& leftOut) {
  const dmat4 transform = parent * fromAssimp(node.mTransformation);
  for (unsigned i = 0; i < node.mNumMeshes; ++i) addMesh(*scene.mMeshes[node.mMeshes[i]], transform, mesh, leftOut);
  for (unsigned i = 0; i < node.mNumChildren; ++i) addNode(scene, *node.mChildren[i], transform, mesh, leftOut);
}

/// Triangles that lost their normals' file have none: a zero normal is no normal.
void dropNormalsIfNone(Mesh& mesh) {
  for (const vec3& normal : mesh.normal)
    if (normal != vec3(0)) return;
  mesh.normal.clear();
}

void checkFile(const Solid& solid, const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) throw InputError(path, "", "a mesh", "a folder");
  if (!std::filesystem::exists(path, ignored))
    throw InputError(path, "", "a mesh", "no such file", nearestNames(solid.file, path));
}

}  // namespace

Bounds Mesh::bounds() const {
  Bounds bounds;
  for (const auto& corners : triangles)
    for (const std::uint32_t corner : corners) bounds.add(position[corner]);
  return bounds;
}

Mesh loadMesh(const Solid& solid, int frame) {
  const std::string path = framePath(solid.file, frame);
  checkFile(solid, path);
  Assimp::Importer importer;
  // What Mote does not read need not be carried along, nor split vertices.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_TEXCOORDS | aiComponent_COLORS | aiComponent_TANGENTS_AND_BITANGENTS |
                                  aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS | aiComponent_TEXTURES |
                                  aiComponent_LIGHTS | aiComponent_CAMERAS);
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_RemoveComponent);
  if (!scene || !scene->mRootNode)
    throw InputError(path, "", "a mesh (OBJ, PLY, STL, glTF, GLB …)", importer.GetErrorString());
  Mesh mesh;
  LeftOut leftOut;
  addNode(*scene, *scene->mRootNode, sceneTransform(solid), mesh, leftOut);
  const std::size_t dropped = leftOut.degenerate + leftOut.notFinite;
  if (mesh.triangles.empty())
    throw InputError(path, "", "a mesh with triangles",
                     dropped == 0
                         ? "none"
                         : fmt::format("{} without area and {} not finite", leftOut.degenerate, leftOut.notFinite));
  if (dropped > 0)
    logWarning(fmt::format("{}: {} triangles without area and {} not finite were left out of {}", path,
                           leftOut.degenerate, leftOut.notFinite, dropped + mesh.triangles.size()));
  dropNormalsIfNone(mesh);
  return mesh;
}

}  // namespace mote
