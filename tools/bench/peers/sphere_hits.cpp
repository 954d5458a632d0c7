#include "tools/bench/peers/sphere_hits.h"

#include <cmath>

#include "host/core/cap.h"
#include "host/core/parallel.h"
#include "host/solids/embree.h"

namespace mote {

struct SphereHits::Scene {
  embree::Device device;
  embree::Scene scene;
};

namespace {

constexpr std::size_t kTaskRays = 1024;
constexpr unsigned kMostRays = 16;

/// What the filter needs of the rays under way; Embree hands it back by the address of its first member.
struct Collector {
  RTCIntersectContext context;
  const Octree* tree;
  float limit;              // optical depth beyond which a ray may end
  float length[kMostRays];  // from the particle to the light; +∞ for a directional one
  unsigned self[kMostRays];
  float depth[kMostRays];
};

/// Both points where a ray meets a sphere come by; the one where it leaves counts.
void collect(const RTCFilterFunctionNArguments* hits) {
  auto& collector = *reinterpret_cast<Collector*>(hits->context);
  const Octree& tree = *collector.tree;
  const unsigned n = hits->N;
  for (unsigned k = 0; k < n; ++k) {
    if (hits->valid[k] == 0) continue;
    const vec3 d(RTCRayN_dir_x(hits->ray, n, k), RTCRayN_dir_y(hits->ray, n, k), RTCRayN_dir_z(hits->ray, n, k));
    const vec3 normal(RTCHitN_Ng_x(hits->hit, n, k), RTCHitN_Ng_y(hits->hit, n, k), RTCHitN_Ng_z(hits->hit, n, k));
    const unsigned slot = RTCHitN_primID(hits->hit, n, k), ray = RTCRayN_id(hits->ray, n, k);
    if (glm::dot(d, normal) > 0 && slot != collector.self[ray]) {
      const vec3 offset = tree.position(slot) - vec3(RTCRayN_org_x(hits->ray, n, k), RTCRayN_org_y(hits->ray, n, k),
                                                     RTCRayN_org_z(hits->ray, n, k));
      const float t = glm::dot(offset, d), radius = tree.radius[slot];
      const vec3 across = offset - t * d;
      const float u = std::max(1 - glm::dot(across, across) / (radius * radius), 0.0f);
      const float chord = radius * std::sqrt(u);
      collector.depth[ray] += tree.peak[slot] * u * u * cap(t, chord) * cap(collector.length[ray] - t, chord);
    }
    if (collector.depth[ray] <= collector.limit) hits->valid[k] = 0;  // reject, so that the ray goes on
  }
}

/// Direction and length of the ray of a slot; false where it has none.
bool aim(const Octree& tree, const layout::Light& light, std::size_t slot, vec3& direction, float& length) {
  direction = -light.direction, length = INFINITY;
  if (light.type == layout::kLightDirectional) return true;
  const vec3 toLight = light.position - tree.position(slot);
  length = glm::length(toLight);
  direction = toLight / length;
  return length > 0;
}

}  // namespace

SphereHits::SphereHits(const Octree& tree) : tree_(tree), scene_(std::make_unique<Scene>()) {
  MOTE_CHECK(tree.channels(), ==, 1u);
  scene_->device.reset(rtcNewDevice(nullptr));
  embree::check(scene_->device.get(), "opening");
}

SphereHits::~SphereHits() = default;

void SphereHits::build() {
  RTCDevice device = scene_->device.get();
  embree::Scene scene(rtcNewScene(device));
  const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT));
  const std::size_t count = tree_.particleCount();
  auto* spheres = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), count));
  embree::check(device, "spheres");
  parallelBlocks(count, kTaskRays, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      spheres[4 * i] = tree_.x[i], spheres[4 * i + 1] = tree_.y[i], spheres[4 * i + 2] = tree_.z[i];
      spheres[4 * i + 3] = tree_.radius[i];
    }
  });
  rtcSetGeometryOccludedFilterFunction(geometry.get(), &collect);
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(scene.get(), geometry.get());
  rtcCommitScene(scene.get());
  embree::check(device, "building");
  scene_->scene = std::move(scene);
}

std::vector<float> SphereHits::opticalDepths(const layout::Light& light, const LightingOptions& options,
                                             Rays rays) const {
  const std::size_t count = tree_.particleCount(), width = static_cast<std::size_t>(rays);
  const float limit = opticalDepthLimit(light, options),
              most = *std::max_element(tree_.radius.begin(), tree_.radius.end());
  RTCScene scene = scene_->scene.get();
  std::vector<float> depths(count);
  parallelBlocks(count, kTaskRays, [&](std::size_t begin, std::size_t end) {
    Collector collector;
    rtcInitIntersectContext(&collector.context);
    collector.tree = &tree_, collector.limit = limit;
    if (rays == Rays::Packets) collector.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (std::size_t first = begin; first < end; first += width) {
      alignas(64) int valid[kMostRays] = {};
      RTCRay16 packet{};
      RTCRay single{};
      for (std::size_t k = 0; k < width; ++k) {
        const std::size_t slot = std::min(first + k, end - 1);
        vec3 d(0);
        valid[k] = first + k < end && aim(tree_, light, slot, d, collector.length[k]) ? -1 : 0;
        collector.self[k] = static_cast<unsigned>(slot), collector.depth[k] = 0;
        // Far enough to leave the balls that the light stands in.
        const float far = collector.length[k] + 2 * most;
        packet.org_x[k] = tree_.x[slot], packet.org_y[k] = tree_.y[slot], packet.org_z[k] = tree_.z[slot];
        packet.dir_x[k] = d.x, packet.dir_y[k] = d.y, packet.dir_z[k] = d.z;
        packet.tnear[k] = 0, packet.tfar[k] = far, packet.mask[k] = 0xffffffffu,
        packet.id[k] = static_cast<unsigned>(k);
        single = {tree_.x[slot], tree_.y[slot], tree_.z[slot], 0, d.x, d.y, d.z, 0, far, 0xffffffffu, 0, 0};
      }
      if (rays == Rays::Packets)
        rtcOccluded16(valid, scene, &collector.context, &packet);
      else if (valid[0] != 0)
        rtcOccluded1(scene, &collector.context, &single);
      for (std::size_t k = 0; k < width && first + k < end; ++k) depths[first + k] = collector.depth[k];
    }
  });
  return depths;
}

}  // namespace mote
