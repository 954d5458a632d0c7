#include "host/lighting/ray_order.h"

#include <cmath>

#include "host/core/parallel.h"
#include "host/lighting/packet.h"

namespace mote {
namespace {

/// 16 strips × 16 groups × 16 rays. Larger blocks give thinner shafts but rays that start farther apart.
constexpr std::size_t kStrips = 16;
constexpr std::size_t kStripRays = 16 * kPacketRays;
constexpr std::size_t kBlockRays = kStrips * kStripRays;

struct Crossing {
  float u, v, depth;  ///< where the ray crosses the light's plane through the block's middle, and how far it starts
  std::uint32_t slot;
};

/// Coordinates on the light's plane: perspective for point lights.
class LightPlane {
 public:
  LightPlane(const layout::Light& light, const vec3& centre) : centre_(centre) {
    const bool point = light.type != layout::kLightDirectional;
    vec3 toLight = point ? light.position - centre : -light.direction;
    distance_ = point ? glm::length(toLight) : std::numeric_limits<float>::infinity();
    toLight = glm::length(toLight) > 0 ? glm::normalize(toLight) : vec3(1, 0, 0);
    axis_ = toLight;
    u_ = glm::normalize(glm::cross(toLight, std::abs(toLight.x) < 0.6f ? vec3(1, 0, 0) : vec3(0, 1, 0)));
    v_ = glm::cross(toLight, u_);
  }

  Crossing cross(const vec3& point, std::uint32_t slot) const {
    const vec3 offset = point - centre_;
    const float along = glm::dot(offset, axis_);
    float scale = 1;
    if (std::isfinite(distance_)) {
      // A light inside the block has no such plane; any finite number will do there.
      const float left = distance_ - along;
      scale = left > 0.01f * distance_ ? distance_ / left : 100.0f;
    }
    return {glm::dot(offset, u_) * scale, glm::dot(offset, v_) * scale, along, slot};
  }

 private:
  vec3 centre_, axis_, u_, v_;
  float distance_;
};

template <float Crossing::*kField>
bool before(const Crossing& a, const Crossing& b) {
  return a.*kField != b.*kField ? a.*kField < b.*kField : a.slot < b.slot;
}

/// Puts the smallest `piece` by a field first, then the next, … : full order between pieces, none within.
template <float Crossing::*kField>
void splitEvenly(Crossing* begin, Crossing* end, std::size_t piece) {
  const auto count = static_cast<std::size_t>(end - begin);
  if (count <= piece) return;
  const std::size_t pieces = (count + piece - 1) / piece;
  Crossing* middle = begin + (pieces / 2) * piece;
  std::nth_element(begin, middle, end, before<kField>);
  splitEvenly<kField>(begin, middle, piece);
  splitEvenly<kField>(middle, end, piece);
}

/// The indices that are reached, ascending.
std::vector<std::uint32_t> indicesOf(std::size_t count, std::span<const std::uint8_t> reached) {
  std::vector<std::uint32_t> indices;
  indices.reserve(count);
  for (std::size_t k = 0; k < count; ++k)
    if (reached.empty() || reached[k] != 0) indices.push_back(static_cast<std::uint32_t>(k));
  return indices;
}

}  // namespace

std::vector<std::uint32_t> rayOrder(const Receivers& receivers, const layout::Light& light,
                                    std::span<const std::uint8_t> reached) {
  std::vector<std::uint32_t> order = indicesOf(receivers.size(), reached);
  parallelBlocks(order.size(), kBlockRays, [&](std::size_t begin, std::size_t end) {
    Bounds bounds;
    for (std::size_t k = begin; k < end; ++k) bounds.add(receivers.position(order[k]));
    const LightPlane plane(light, bounds.centre());
    std::vector<Crossing> rays(end - begin);
    for (std::size_t k = begin; k < end; ++k) rays[k - begin] = plane.cross(receivers.position(order[k]), order[k]);
    Crossing* first = rays.data();
    Crossing* last = first + rays.size();
    splitEvenly<&Crossing::u>(first, last, kStripRays);
    for (Crossing* strip = first; strip < last; strip += kStripRays) {
      Crossing* stripEnd = std::min(strip + kStripRays, last);
      splitEvenly<&Crossing::v>(strip, stripEnd, kPacketRays);
      if (stripEnd == last) break;
    }
    for (std::size_t i = 0; i < rays.size(); ++i) order[begin + i] = rays[i].slot;
  });
  return order;
}

}  // namespace mote
