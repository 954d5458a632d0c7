// Meshes and ways to aim at them, as tests of solids need them.
#pragma once
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "host/core/random.h"
#include "host/lighting/receivers.h"
#include "host/solids/mesh.h"

namespace mote::test {

/// A mesh without vertex normals from any list of corners; equal corners become one vertex.
inline Mesh weld(const std::vector<std::array<vec3, 3>>& triangles) {
  const auto less = [](const vec3& a, const vec3& b) {
    return std::pair(a.x, std::pair(a.y, a.z)) < std::pair(b.x, std::pair(b.y, b.z));
  };
  std::map<vec3, std::uint32_t, decltype(less)> index(less);
  Mesh mesh;
  for (const auto& triangle : triangles) {
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [it, isNew] = index.try_emplace(triangle[k], static_cast<std::uint32_t>(mesh.position.size()));
      if (isNew) mesh.position.push_back(triangle[k]);
      corners[k] = it->second;
    }
    mesh.triangles.push_back(corners);
  }
  return mesh;
}

/// The cube [−1, 1]³, each face cells × cells squares, mapped by `place`.
template <class Place>
Mesh boxMesh(int cells, const Place& place) {
  std::vector<std::array<vec3, 3>> triangles;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f})
      for (int i = 0; i < cells; ++i)
        for (int j = 0; j < cells; ++j) {
          const auto corner = [&](int u, int v) {
            vec3 p(side);
            p[(axis + 1) % 3] = 2.0f * float(u) / float(cells) - 1.0f;
            p[(axis + 2) % 3] = 2.0f * float(v) / float(cells) - 1.0f;
            return place(p);
          };
          triangles.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
          triangles.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
        }
  return weld(triangles);
}
inline Mesh boxMesh(int cells = 1) {
  return boxMesh(cells, [](const vec3& p) { return p; });
}

/// A closed ball of 12 · cells² triangles, all corners on the sphere; with the sphere's normals.
inline Mesh ballMesh(int cells, const vec3& centre, float radius) {
  Mesh mesh =
      boxMesh(cells, [&](const vec3& p) { return vec3(dvec3(centre) + glm::normalize(dvec3(p)) * double(radius)); });
  for (const vec3& p : mesh.position) mesh.normal.push_back(vec3(glm::normalize(dvec3(p) - dvec3(centre))));
  return mesh;
}

inline std::vector<layout::Triangle> trianglesOf(const Mesh& mesh) {
  std::vector<layout::Triangle> triangles;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) triangles.push_back(mesh.triangle(k));
  return triangles;
}

/// Points in arrays of their own.
struct Points {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> self;
  void add(const vec3& p) { x.push_back(p.x), y.push_back(p.y), z.push_back(p.z), self.push_back(kNoSlot); }
  Receivers receivers() const { return {x, y, z, self}; }
};

/// Points outside of the mesh's box such that the rays from there to a light at `eye` (in the box) pass every corner,
/// nine places of every edge, and `count` random directions.
inline Points pointsBehind(const Mesh& mesh, const vec3& eye, std::size_t count) {
  Points points;
  const double size = glm::length(dvec3(mesh.bounds().size()));
  const auto aim = [&](const dvec3& target) {  // stretched by a power of two: rounds no coordinate that was round
    dvec3 offset = target - dvec3(eye);
    while (glm::length(offset) < 2 * size) offset *= 2;
    points.add(vec3(dvec3(eye) + offset));
  };
  for (const vec3& corner : mesh.position) aim(corner);
  for (const auto& triangle : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const dvec3 a = mesh.position[triangle[k]], b = mesh.position[triangle[(k + 1) % 3]];
      for (int i = 1; i < 10; ++i) aim(glm::mix(a, b, i / 10.0));
    }
  for (std::size_t i = 0; i < count; ++i) points.add(vec3(dvec3(eye) + Random(5, i).direction() * (2 * size)));
  return points;
}

}  // namespace mote::test
