#include "host/solids/surfaces.h"

#include <algorithm>
#include <cmath>

#include "host/core/parallel.h"
#include "host/image/image.h"
#include "host/solids/embree.h"
#include "host/solids/occlusion.h"
#include "shaders/glsl/layout/splat_scene.h"

namespace mote {
namespace {

/// Where the rays of a pixel go: Hammersley's points, so that edges of any slope, upright and level ones too, meet
/// as many different steps as there are rays.
vec2 rayPlace(int k, int count) {
  float inverse = 0.5f / static_cast<float>(count), digit = 0.5f;
  for (int i = k; i > 0; i /= 2, digit /= 2) inverse += static_cast<float>(i % 2) * digit;
  return {(static_cast<float>(k) + 0.5f) / static_cast<float>(count), inverse};
}

struct Hit {
  std::uint32_t solid, triangle;
  SolidMode mode;  ///< of the solid
  float depth;
  vec3 point, face, normal;  ///< geometric and shading normal, both toward the camera
  vec3 start;                ///< of shadow rays: the point, or above it where the smooth surface bulges
};

/// The rays of one surface in a pixel, as indices into the pixel's hits.
struct Group {
  std::array<int, kEdgeRays> hits;
  int count = 0;
};

class Tracer {
 public:
  Tracer(std::span<const Solid> solids, std::span<const Mesh> meshes, const layout::SplatCamera& camera)
      : solids_(solids),
        meshes_(meshes),
        camera_(camera),
        device_(embree::makeDevice()),
        scene_(rtcNewScene(device_.get())) {
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    for (std::size_t k = 0; k < solids.size(); ++k) {
      if (solids[k].mode == SolidMode::Hidden) continue;
      const embree::Geometry geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
      const Mesh& mesh = meshes[k];
      void* corners = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                              sizeof(vec3), mesh.position.size());
      void* indices = rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              sizeof(mesh.triangles[0]), mesh.triangles.size());
      embree::check(device_.get(), "copying a mesh");
      std::copy(mesh.position.begin(), mesh.position.end(), static_cast<vec3*>(corners));
      std::copy(mesh.triangles.begin(), mesh.triangles.end(), static_cast<std::array<std::uint32_t, 3>*>(indices));
      rtcCommitGeometry(geometry.get());
      rtcAttachGeometryByID(scene_.get(), geometry.get(), static_cast<unsigned>(k));
    }
    rtcCommitScene(scene_.get());
    embree::check(device_.get(), "building the tree of what is seen");
  }

  bool hit(const vec2& at, Hit& result) const {
    const vec2 middle = 0.5f * camera_.imageSize;
    const float u = (at.x - middle.x) * (camera_.pixelSize * camera_.pixelAspect);
    const float v = (middle.y - at.y) * camera_.pixelSize;
    const vec3 beside = camera_.right * u + camera_.up * v;
    const bool parallel = camera_.orthographic != 0;
    const vec3 origin = parallel ? camera_.position + beside : camera_.position;
    const vec3 direction = parallel ? camera_.forward : camera_.forward + beside;  // t is the depth either way
    RTCRayHit ray{};
    ray.ray.org_x = origin.x, ray.ray.org_y = origin.y, ray.ray.org_z = origin.z;
    ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
    ray.ray.tnear = camera_.near, ray.ray.tfar = camera_.far;
    ray.ray.mask = ~0u;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_.get(), &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    const Mesh& mesh = meshes_[ray.hit.geomID];
    const auto [a, b, c] = mesh.triangles[ray.hit.primID];
    const float wb = ray.hit.u, wc = ray.hit.v, wa = 1 - wb - wc;
    result.solid = ray.hit.geomID, result.triangle = ray.hit.primID, result.depth = ray.ray.tfar;
    result.mode = solids_[result.solid].mode;
    result.point = mesh.position[a] * wa + mesh.position[b] * wb + mesh.position[c] * wc;
    result.face = glm::normalize(vec3(glm::cross(dvec3(mesh.position[b]) - dvec3(mesh.position[a]),
                                                 dvec3(mesh.position[c]) - dvec3(mesh.position[a]))));
    if (glm::dot(result.face, direction) > 0) result.face = -result.face;
    result.normal = result.face;
    result.start = result.point;
    if (!mesh.normal.empty()) {
      const vec3 smooth = mesh.normal[a] * wa + mesh.normal[b] * wb + mesh.normal[c] * wc;
      const float length = glm::length(smooth);
      if (length > 0) {
        const float side = glm::dot(smooth, result.face) < 0 ? -1.0f : 1.0f;
        result.normal = side * smooth / length;
        // A smooth surface's shadows must not begin where its flat facets turn from the light: the point moves to the
        // tangent planes of the corners (Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing Gems II).
        const std::uint32_t corners[] = {a, b, c};
        const float weights[] = {wa, wb, wc};
        for (int k = 0; k < 3; ++k) {
          const vec3 tangent = side * mesh.normal[corners[k]];
          result.start -=
              weights[k] * std::min(glm::dot(result.point - mesh.position[corners[k]], tangent), 0.0f) * tangent;
        }
      }
    }
    return true;
  }

  /// Where shadow rays of a point may start.
  vec3 beside(const Hit& hit) const {
    return hit.start + hit.face * surfaceOffset(meshes_[hit.solid].triangle(hit.triangle), hit.point);
  }

  /// Edge of a pixel at a depth [scene units].
  float pixelEdge(float depth) const {
    return camera_.pixelSize * std::max(camera_.pixelAspect, 1.0f) * (camera_.orthographic != 0 ? 1 : depth);
  }

 private:
  std::span<const Solid> solids_;
  std::span<const Mesh> meshes_;
  const layout::SplatCamera& camera_;
  embree::Device device_;
  embree::Scene scene_;
};

/// The same solid, facing about the same way, in about one plane.
bool together(const Hit& a, const Hit& b, float edge) {
  return a.solid == b.solid && glm::dot(a.face, b.face) > 0.5f &&
         std::fabs(glm::dot(b.point - a.point, a.face)) <= 2 * edge;
}

float meanDepth(const Group& group, const Hit* hits) {
  float sum = 0;
  for (int k = 0; k < group.count; ++k) sum += hits[group.hits[static_cast<std::size_t>(k)]].depth;
  return sum / static_cast<float>(group.count);
}

/// The group of the same mode that is nearest in depth; groups.end() if there is none. What is shown and what is only
/// cut out must not become one.
std::vector<Group>::iterator partnerOf(std::vector<Group>::iterator group, std::vector<Group>& groups,
                                       const Hit* hits) {
  const auto mode = [&](const Group& g) { return hits[g.hits[0]].mode; };
  const float depth = meanDepth(*group, hits);
  auto nearest = groups.end();
  for (auto other = groups.begin(); other != groups.end(); ++other) {
    if (other == group || mode(*other) != mode(*group)) continue;
    const float distance = std::fabs(meanDepth(*other, hits) - depth);
    if (nearest == groups.end() || distance < std::fabs(meanDepth(*nearest, hits) - depth)) nearest = other;
  }
  return nearest;
}

/// The smallest groups join others until there is room for what is beside all surfaces. Two modes are seen, so among
/// more than three groups some two have the same.
void mergeGroups(std::vector<Group>& groups, const Hit* hits) {
  const auto larger = [](const Group& a, const Group& b) { return a.count > b.count; };
  std::stable_sort(groups.begin(), groups.end(), larger);
  while (groups.size() > kSurfaceClasses - 1) {
    auto smallest = groups.end() - 1;
    auto partner = partnerOf(smallest, groups, hits);
    while (partner == groups.end()) partner = partnerOf(--smallest, groups, hits);
    for (int k = 0; k < smallest->count; ++k)
      partner->hits[static_cast<std::size_t>(partner->count++)] = smallest->hits[static_cast<std::size_t>(k)];
    groups.erase(smallest);
    std::stable_sort(groups.begin(), groups.end(), larger);
  }
}

Surface surfaceOf(const Group& group, const Hit* hits, int rays, std::uint32_t pixel, const Tracer& tracer) {
  vec3 middle(0), normal(0);
  for (int k = 0; k < group.count; ++k) {
    const Hit& hit = hits[group.hits[static_cast<std::size_t>(k)]];
    middle += hit.point / static_cast<float>(group.count);
    normal += hit.normal;
  }
  int lit = group.hits[0];
  for (int k = 1; k < group.count; ++k) {
    const int index = group.hits[static_cast<std::size_t>(k)];
    if (glm::distance(hits[index].point, middle) < glm::distance(hits[lit].point, middle)) lit = index;
  }
  Surface surface{};
  surface.pixel = pixel;
  surface.solid = static_cast<std::uint16_t>(hits[lit].solid);
  surface.coverage = static_cast<float>(group.count) / static_cast<float>(rays);
  surface.depth = meanDepth(group, hits);
  surface.normal = glm::length(normal) > 0 ? glm::normalize(normal) : hits[lit].normal;
  surface.shadowPoints = static_cast<std::uint16_t>(std::min(group.count, kShadowPoints));
  surface.points[0] = tracer.beside(hits[lit]);
  for (int k = 1; k < surface.shadowPoints; ++k)
    surface.points[static_cast<std::size_t>(k)] =
        tracer.beside(hits[group.hits[static_cast<std::size_t>(k * group.count / surface.shadowPoints)]]);
  return surface;
}

/// Casts rays through a pixel; fills `hits` and what belongs together.
int castRays(const Tracer& tracer, int x, int y, int rays, Hit* hits, std::vector<Group>& groups) {
  int count = 0;
  for (int k = 0; k < rays; ++k)
    if (tracer.hit(vec2(x, y) + rayPlace(k, rays), hits[count])) ++count;
  groups.clear();
  for (int k = 0; k < count; ++k) {
    const float edge = tracer.pixelEdge(hits[k].depth);
    auto mine = std::find_if(groups.begin(), groups.end(),
                             [&](const Group& group) { return together(hits[group.hits[0]], hits[k], edge); });
    if (mine == groups.end()) mine = groups.insert(groups.end(), Group{});
    mine->hits[static_cast<std::size_t>(mine->count++)] = k;
  }
  return count;
}

/// True where an edge runs through the pixel: its rays, or those through its corners, meet different things.
bool crossed(const Tracer& tracer, int x, int y, int count, const Hit* hits, const std::vector<Group>& groups) {
  if ((count != 0 && count != kSurfaceRays) || groups.size() > 1) return true;
  for (int corner = 0; corner < 4; ++corner) {
    Hit hit;
    const bool met = tracer.hit(vec2(x + corner % 2, y + corner / 2), hit);
    if (met != (count > 0) || (met && !together(hits[0], hit, tracer.pixelEdge(hit.depth)))) return true;
  }
  return false;
}

void tracePixel(const Tracer& tracer, int x, int y, std::uint32_t pixel, std::vector<Surface>& out) {
  Hit hits[kEdgeRays];
  std::vector<Group> groups;
  int rays = kSurfaceRays;
  const int count = castRays(tracer, x, y, rays, hits, groups);
  if (crossed(tracer, x, y, count, hits, groups)) castRays(tracer, x, y, rays = kEdgeRays, hits, groups);
  mergeGroups(groups, hits);
  for (const Group& group : groups) out.push_back(surfaceOf(group, hits, rays, pixel, tracer));
}

}  // namespace

int Surfaces::drawings() const {
  int most = 1;
  for (std::size_t p = 0; p + 1 < first.size(); ++p) {
    float covered = 0;
    for (std::size_t k = first[p]; k < first[p + 1]; ++k) covered += all[k].coverage;
    most = std::max(most, static_cast<int>(first[p + 1] - first[p]) + (covered < 1 ? 1 : 0));
  }
  return most;
}

const Surface* Surfaces::at(std::size_t pixel, int k, float& coverage) const {
  const std::size_t begin = first[pixel], count = first[pixel + 1] - begin;
  const auto place = static_cast<std::size_t>(k);
  if (place < count) {
    coverage = all[begin + place].coverage;
    return &all[begin + place];
  }
  coverage = 0;
  if (place == count) {  // what is beside them: coverages are in 64ths, their sum is exact
    coverage = 1;
    for (std::size_t i = begin; i < begin + count; ++i) coverage -= all[i].coverage;
  }
  return nullptr;
}

std::vector<float> Surfaces::depths(int k) const {
  std::vector<float> result(first.size() - 1);
  parallelBlocks(result.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      float coverage = 0;
      const Surface* surface = at(pixel, k, coverage);
      result[pixel] = surface ? surface->depth : coverage > 0 ? kNoDepth : layout::kPixelLeftOut;
    }
  });
  return result;
}

Surfaces traceSurfaces(std::span<const Solid> solids, std::span<const Mesh> meshes, const layout::SplatCamera& camera) {
  const Tracer tracer(solids, meshes, camera);
  Surfaces result;
  result.width = static_cast<int>(camera.imageSize.x), result.height = static_cast<int>(camera.imageSize.y);
  std::vector<std::vector<Surface>> rows(static_cast<std::size_t>(result.height));
  parallelBlocks(rows.size(), 1, [&](std::size_t y, std::size_t) {
    for (int x = 0; x < result.width; ++x)
      tracePixel(
          tracer, x, static_cast<int>(y),
          static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(result.width) + static_cast<std::uint32_t>(x),
          rows[y]);
  });
  std::size_t count = 0;
  for (const std::vector<Surface>& row : rows) count += row.size();
  result.all.reserve(count);
  result.first.assign(static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height) + 1, 0);
  for (std::vector<Surface>& row : rows) {
    for (const Surface& surface : row) ++result.first[surface.pixel + 1];
    result.all.insert(result.all.end(), row.begin(), row.end());
    row = {};
  }
  for (std::size_t p = 1; p < result.first.size(); ++p) result.first[p] += result.first[p - 1];
  return result;
}

}  // namespace mote
