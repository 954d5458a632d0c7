#include "host/lighting/exact/column.h"

#include <algorithm>
#include <cmath>

namespace mote {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Columns wider than this many least radii are precise: rounding of u is 3e-8 of the width.
constexpr double kPreciseRadii = 256;
/// Where unused planes stand: no particle is beyond.
constexpr float kFarOff = 3e38f;
/// Bins of the sort: a few particles each, and few enough that the counts stay in the first cache.
constexpr std::size_t kBinParticles = 4, kMostBins = 2048;

template <class T>
void growTo(std::vector<T>& array, std::size_t size) {
  if (array.size() < size) array.resize(std::max(size, array.size() + array.size() / 2));
}

void clearPlanes(ColumnPlanes& planes, const vec3& origin) {
  planes.origin = origin;
  for (int k = 0; k < 8; ++k) {
    planes.x[k] = planes.y[k] = planes.z[k] = planes.absX[k] = planes.absY[k] = planes.absZ[k] = 0;
    planes.offset[k] = kFarOff;
  }
}

void setPlane(ColumnPlanes& planes, int k, const dvec3& normal, double offset, float slack) {
  const double length = glm::length(normal);
  const vec3 n(normal / length);
  planes.x[k] = n.x, planes.y[k] = n.y, planes.z[k] = n.z;
  planes.absX[k] = std::abs(n.x), planes.absY[k] = std::abs(n.y), planes.absZ[k] = std::abs(n.z);
  planes.offset[k] = static_cast<float>(std::min(offset / length + slack, double(kFarOff)));
}

void sortKeys(Column::Key* begin, Column::Key* end) {
  const auto before = [](const Column::Key& a, const Column::Key& b) {
    return a.reach != b.reach ? a.reach < b.reach : a.index < b.index;
  };
  if (end - begin > 16) return std::sort(begin, end, before);
  for (Column::Key* key = begin; key < end; ++key) {
    const Column::Key moving = *key;
    Column::Key* at = key;
    for (; at > begin && before(moving, at[-1]); --at) *at = at[-1];
    *at = moving;
  }
}

int faceOf(const dvec3& p) {
  const dvec3 size = glm::abs(p);
  return size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
}

}  // namespace

void GatheredParticles::reserve(std::size_t more, std::size_t channels) {
  const std::size_t size = count + more + kPacketRays;
  for (auto* array : {&x, &y, &z, &radius}) growTo(*array, size);
  for (std::size_t c = 0; c < channels; ++c) growTo(peak[c], size);
  growTo(slot, size);
}

void PlacedParticles::resize(std::size_t count) {
  for (auto* array : {&u, &uLow, &v, &vLow, &inverseArea, &extent, &reach, &behind, &depth, &depthLow, &sagFirst,
                      &sagRatio, &nearX, &nearY, &nearZ})
    growTo(*array, count + kPacketRays);
  growTo(place, count + kPacketRays);
}

ColumnRules columnRules(const Octree& tree, const layout::Light& light, const Bounds& origins) {
  Bounds bounds = tree.bounds();
  if (bounds.empty()) return {};
  if (!origins.empty()) bounds.add(origins);
  if (light.type != layout::kLightDirectional) bounds.add(light.position);
  const float extent =
      std::max(glm::length(bounds.size()), glm::length(glm::max(glm::abs(bounds.lo), glm::abs(bounds.hi))));
  // Coordinates, differences and normals each round to 6e-8 of the extent; 2e-6 leaves a factor of ten.
  return {2e-6f * extent, tree.leastRadius};
}

ColumnPlanes planesAround(const LightFrame& frame, const dvec2& lo, const dvec2& hi, double deepest, float slack) {
  ColumnPlanes planes;
  clearPlanes(planes, vec3(frame.origin));
  if (frame.perspective) {
    setPlane(planes, 0, -frame.u + lo.x * frame.axis, 0, slack);
    setPlane(planes, 1, frame.u - hi.x * frame.axis, 0, slack);
    setPlane(planes, 2, -frame.v + lo.y * frame.axis, 0, slack);
    setPlane(planes, 3, frame.v - hi.y * frame.axis, 0, slack);
    setPlane(planes, 5, -frame.axis, 0, slack);
  } else {
    setPlane(planes, 0, -frame.u, -lo.x, slack);
    setPlane(planes, 1, frame.u, hi.x, slack);
    setPlane(planes, 2, -frame.v, -lo.y, slack);
    setPlane(planes, 3, frame.v, hi.y, slack);
  }
  setPlane(planes, 4, frame.axis, deepest, slack);
  return planes;
}

LightFrame frameAbout(const dvec3& origin, const dvec3& axis, bool perspective) {
  LightFrame frame{perspective, origin, {}, {}, axis};
  frame.u = glm::normalize(glm::cross(axis, std::abs(axis.x) < 0.6 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
  frame.v = glm::cross(axis, frame.u);
  return frame;
}

dvec3 middleDirection(const dvec3& light, const Receivers& receivers, std::span<const std::uint32_t> members) {
  const int face = faceOf(dvec3(receivers.position(members.front())) - light);
  dvec3 lo(kInfinity), hi(-kInfinity);
  for (const std::uint32_t member : members) {
    dvec3 p = dvec3(receivers.position(member)) - light;
    p /= std::abs(p[face]);
    lo = glm::min(lo, p), hi = glm::max(hi, p);
  }
  return glm::normalize(lo + hi);
}

void Column::setRays(const Receivers& receivers, const layout::Light& light, std::span<const std::uint32_t> members,
                     const ColumnRules& rules) {
  const bool perspective = light.type != layout::kLightDirectional;
  const dvec3 origin(perspective ? light.position : receivers.position(members[members.size() / 2]));
  frame = frameAbout(origin,
                     perspective ? middleDirection(origin, receivers, members) : glm::normalize(dvec3(light.direction)),
                     perspective);
  dvec2 lo(kInfinity), hi(-kInfinity);
  double nearest = kInfinity, deepest = -kInfinity;
  for (const std::uint32_t member : members) {
    const dvec3 p = dvec3(receivers.position(member)) - origin;
    const double z = glm::dot(p, frame.axis), scale = perspective ? 1 / z : 1;
    const dvec2 place(glm::dot(p, frame.u) * scale, glm::dot(p, frame.v) * scale);
    lo = glm::min(lo, place), hi = glm::max(hi, place);
    const double depth = perspective ? glm::length(p) : z;
    nearest = std::min(nearest, depth), deepest = std::max(deepest, depth);
  }
  depthBase = 0.5 * (nearest + deepest);
  const double across = std::max(hi.x - lo.x, hi.y - lo.y) * (perspective ? deepest : 1);
  precise = across > kPreciseRadii * rules.leastRadius;
  margin = rules.slack;
  planes = planesAround(frame, lo, hi, deepest, rules.slack);
}

void Column::setLine(const vec3& point, const vec3& direction, const ColumnRules& rules) {
  frame = frameAbout(dvec3(point), glm::normalize(dvec3(direction)), false);
  depthBase = 0;
  margin = rules.slack;
  precise = false;
  planes = planesAround(frame, {0, 0}, {0, 0}, kInfinity, rules.slack);
}

void Column::sort(std::size_t channels) {
  // Counted into bins of equal width and sorted there, by (reach, index): for thousands of particles at similar
  // distances twice as fast as one sort, and never slower where they are not.
  nearLight.clear();
  const std::size_t count = gathered.count;
  float lowest = std::numeric_limits<float>::infinity(), highest = -lowest;
  sorted.greatestRadius = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (placed.place[i] == Place::NearLight) nearLight.push_back(static_cast<std::uint32_t>(i));
    if (placed.place[i] != Place::Sorted) continue;
    ++kept;
    lowest = std::min(lowest, placed.reach[i]), highest = std::max(highest, placed.reach[i]);
    sorted.greatestRadius = std::max(sorted.greatestRadius, gathered.radius[i]);
  }
  sorted.count = kept;
  for (auto* array : {&sorted.u, &sorted.v, &sorted.extent, &sorted.inverseArea, &sorted.reach})
    growTo(*array, kept + kPacketRays);
  for (std::size_t c = 0; c < channels; ++c) growTo(sorted.peak[c], kept + kPacketRays);
  growTo(sorted.index, kept + kPacketRays);
  if (kept == 0) return;

  const std::size_t bins = std::clamp<std::size_t>(kept / kBinParticles, 1, kMostBins);
  const float scale = highest > lowest ? static_cast<float>(bins) / (highest - lowest) : 0;
  starts_.assign(bins + 1, 0);
  growTo(binOf_, count);
  for (std::size_t i = 0; i < count; ++i) {
    if (placed.place[i] != Place::Sorted) continue;
    const auto bin = static_cast<std::uint32_t>((placed.reach[i] - lowest) * scale);
    binOf_[i] = std::min(bin, static_cast<std::uint32_t>(bins - 1));
    ++starts_[binOf_[i] + 1];
  }
  for (std::size_t b = 0; b < bins; ++b) starts_[b + 1] += starts_[b];
  growTo(keys_, kept);
  for (std::size_t i = 0; i < count; ++i)
    if (placed.place[i] == Place::Sorted)
      keys_[starts_[binOf_[i]]++] = {placed.reach[i], static_cast<std::uint32_t>(i)};
  std::size_t begin = 0;  // each start has moved to the bin's end
  for (std::size_t b = 0; b < bins; begin = starts_[b++]) sortKeys(keys_.data() + begin, keys_.data() + starts_[b]);
  for (std::size_t k = 0; k < kept; ++k) sorted.reach[k] = keys_[k].reach, sorted.index[k] = keys_[k].index;
  for (std::size_t k = 0; k < kept; ++k) {
    const std::uint32_t i = sorted.index[k];
    sorted.u[k] = placed.u[i], sorted.v[k] = placed.v[i];
    sorted.extent[k] = placed.extent[i], sorted.inverseArea[k] = placed.inverseArea[i];
    for (std::size_t c = 0; c < channels; ++c) sorted.peak[c][k] = gathered.peak[c][i];
  }
}

}  // namespace mote
