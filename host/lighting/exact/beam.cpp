#include "host/lighting/exact/beam.h"

#include <algorithm>
#include <cmath>

namespace mote {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// u² + v² up to which a beam counts as narrow: b² is then off by at most this share of itself.
constexpr double kNarrow = 4e-5;
/// Against rounding, relative to extents and to places.
constexpr double kExtentSlack = 1e-5, kPlaceSlack = 1e-6;

float lowPart(double value) { return static_cast<float>(value - static_cast<double>(static_cast<float>(value))); }

/// A rectangle of places (u, v).
struct Box {
  dvec2 lo{kInfinity}, hi{-kInfinity};
  void add(const dvec2& place) { lo = glm::min(lo, place), hi = glm::max(hi, place); }
  /// Greatest u² + v².
  double reach() const {
    const dvec2 far = glm::max(glm::abs(lo), glm::abs(hi));
    return glm::dot(far, far);
  }
};

dvec2 placeIn(const LightFrame& frame, const dvec3& p) {
  const double z = frame.perspective ? glm::dot(p, frame.axis) : 1;
  return {glm::dot(p, frame.u) / z, glm::dot(p, frame.v) / z};
}

void growTo(std::vector<float>& array, std::size_t size) {
  if (array.size() < size) array.resize(std::max(size, array.size() + array.size() / 2));
}

}  // namespace

void BeamParticles::resize(std::size_t most, std::size_t channels) {
  for (auto* array : {&u, &v, &inverseArea, &reach}) growTo(*array, most + kPacketRays);
  for (std::size_t c = 0; c < channels; ++c) growTo(peak[c], most + kPacketRays);
  if (index.size() < most + kPacketRays) index.resize(most + most / 2 + kPacketRays);
}

void Beam::resize(std::size_t count) {
  const std::size_t padded = (count + kPacketRays - 1) / kPacketRays * kPacketRays;
  for (auto* array : {&rays.u, &rays.uLow, &rays.v, &rays.vLow, &rays.slopeU, &rays.slopeV, &rays.inverseNorm,
                      &rays.depth, &rays.depthLow, &rays.x, &rays.y, &rays.z, &rays.length})
    array->resize(padded);
  rays.self.resize(padded);
  rays.receiver.resize(count);
}

void Beam::setRays(const Column& column, const Receivers& receivers, std::span<const std::uint32_t> members,
                   bool inColumnFrame) {
  const LightFrame& wide = column.frame;
  const auto offset = [&](std::uint32_t member) { return dvec3(receivers.position(member)) - wide.origin; };
  Box box;
  starts_.clear();
  for (const std::uint32_t member : members) {
    const dvec3 p = offset(member);
    box.add(placeIn(wide, p));
    starts_.push_back({wide.perspective ? glm::length(p) : glm::dot(p, wide.axis), member});
  }
  std::sort(starts_.begin(), starts_.end(), [](const Start& a, const Start& b) {
    return a.depth != b.depth ? a.depth < b.depth : a.receiver < b.receiver;
  });

  // A frame of the beam's own about its middle; the column's where that would not be exact.
  const dvec2 middle = 0.5 * (box.lo + box.hi);
  LightFrame frame = wide;
  if (wide.perspective)
    frame = frameAbout(wide.origin, glm::normalize(wide.axis + middle.x * wide.u + middle.y * wide.v), true);
  const dvec2 half = 0.5 * (box.hi - box.lo);
  careful = inColumnFrame || column.precise || (wide.perspective && glm::dot(half, half) > kNarrow);
  if (careful) frame = wide;
  const dvec2 shift = careful || wide.perspective ? dvec2(0) : middle;
  const dvec3* from[3] = {&wide.u, &wide.v, &wide.axis};
  const dvec3* to[3] = {&frame.u, &frame.v, &frame.axis};
  for (int row = 0; row < 3; ++row)
    for (int c = 0; c < 3; ++c) turn[row][c] = static_cast<float>(glm::dot(*to[row], *from[c]));
  if (!wide.perspective || careful)
    for (int row = 0; row < 3; ++row)
      for (int c = 0; c < 3; ++c) turn[row][c] = row == c;
  if (!wide.perspective) turn[0][2] = static_cast<float>(-shift.x), turn[1][2] = static_cast<float>(-shift.y);

  // A sphere's image on the plane is wider than r/z by √(1 + u²) where its edge stands at u.
  const double stretch = wide.perspective ? std::sqrt(1 + box.reach()) : 1;
  extentScale = static_cast<float>(stretch * (1 + kExtentSlack));
  const dvec2 slack = kPlaceSlack * (glm::abs(box.lo) + glm::abs(box.hi));
  lowU = static_cast<float>(box.lo.x - slack.x), highU = static_cast<float>(box.hi.x + slack.x);
  lowV = static_cast<float>(box.lo.y - slack.y), highV = static_cast<float>(box.hi.y + slack.y);

  resize(starts_.size());
  for (std::size_t k = 0; k < rays.u.size(); ++k) {
    const Start& start = starts_[std::min(k, starts_.size() - 1)];
    const dvec3 p = offset(start.receiver);
    const dvec2 place = placeIn(frame, p) - shift;
    rays.u[k] = static_cast<float>(place.x), rays.uLow[k] = lowPart(place.x);
    rays.v[k] = static_cast<float>(place.y), rays.vLow[k] = lowPart(place.y);
    const dvec2 slope = wide.perspective ? place : dvec2(0);
    rays.slopeU[k] = static_cast<float>(slope.x), rays.slopeV[k] = static_cast<float>(slope.y);
    rays.inverseNorm[k] = static_cast<float>(1 / (1 + glm::dot(slope, slope)));
    const double depth = start.depth - column.depthBase;
    rays.depth[k] = static_cast<float>(depth), rays.depthLow[k] = lowPart(depth);
    const dvec3 direction = p / start.depth;
    rays.x[k] = static_cast<float>(glm::dot(direction, wide.u));
    rays.y[k] = static_cast<float>(glm::dot(direction, wide.v));
    rays.z[k] = static_cast<float>(glm::dot(direction, wide.axis));
    rays.length[k] = static_cast<float>(start.depth);
    rays.self[k] = receivers.selfOf(start.receiver);
    if (k < starts_.size()) rays.receiver[k] = start.receiver;
  }
}

void Beam::setLine() {
  resize(1);
  for (auto* array : {&rays.u, &rays.uLow, &rays.v, &rays.vLow, &rays.slopeU, &rays.slopeV, &rays.depthLow})
    std::fill(array->begin(), array->end(), 0.0f);
  std::fill(rays.inverseNorm.begin(), rays.inverseNorm.end(), 1.0f);
  std::fill(rays.depth.begin(), rays.depth.end(), std::numeric_limits<float>::infinity());
  std::fill(rays.self.begin(), rays.self.end(), kNoSlot);
  rays.receiver[0] = 0;
  careful = false;
  lowU = highU = lowV = highV = 0;
  extentScale = 1;
  for (int row = 0; row < 3; ++row)
    for (int c = 0; c < 3; ++c) turn[row][c] = row == c;
}

}  // namespace mote
