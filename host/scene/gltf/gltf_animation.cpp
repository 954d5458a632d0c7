#include "host/scene/gltf/gltf_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "host/core/error.h"

namespace mote {
namespace {

using Interpolation = GltfTrack::Interpolation;

Interpolation interpolationOf(const GltfValue& value) {
  const std::string word = value ? value.text() : "LINEAR";
  if (word == "LINEAR") return Interpolation::Linear;
  if (word == "STEP") return Interpolation::Step;
  if (word != "CUBICSPLINE") value.refuse("LINEAR, STEP or CUBICSPLINE", quotedForMessage(word));
  return Interpolation::Cubic;
}

void requireAscending(const GltfValue& input, const std::vector<float>& times) {
  if (times.empty()) input.refuse("times of keys", "none");
  const auto fault = std::adjacent_find(times.begin(), times.end(), [](float a, float b) { return !(a < b); });
  if (fault != times.end())
    input.refuse("times that ascend",
                 fmt::format("{} s after {} s at key {}", fault[1], fault[0], fault - times.begin() + 1));
}

glm::dquat quaternion(const glm::dvec4& xyzw) { return {xyzw.w, xyzw.x, xyzw.y, xyzw.z}; }

}  // namespace

glm::dvec4 GltfTrack::at(double time, double snap) const {
  const std::size_t parts = interpolation == Interpolation::Cubic ? 3 : 1, middle = parts / 2;
  const auto part = [&](std::size_t key, std::size_t which) {
    glm::dvec4 value(0);
    for (std::size_t k = 0; k < width; ++k)
      value[static_cast<int>(k)] = static_cast<double>((*values)[(key * parts + which) * width + k]);
    return value;
  };
  const auto seconds = [&](std::size_t key) { return static_cast<double>((*times)[key]); };
  const auto after =
      static_cast<std::size_t>(std::upper_bound(times->begin(), times->end(), time + snap,
                                                [](double at, float key) { return at < static_cast<double>(key); }) -
                               times->begin());
  if (after == 0) return part(0, middle);
  const std::size_t key = after - 1;
  const bool onKey = time - seconds(key) <= snap;
  if (after == times->size() || onKey || interpolation == Interpolation::Step) return part(key, middle);

  const double length = seconds(after) - seconds(key), s = (time - seconds(key)) / length, r = 1 - s;
  if (interpolation == Interpolation::Cubic)
    return r * r * (1 + 2 * s) * part(key, 1) + s * s * (3 - 2 * s) * part(after, 1) +
           length * s * r * (r * part(key, 2) - s * part(after, 0));
  if (width == 3) return r * part(key, 0) + s * part(after, 0);
  const glm::dquat turned = glm::slerp(glm::normalize(quaternion(part(key, 0))),
                                       glm::normalize(quaternion(part(after, 0))), s);  // the shorter way
  return {turned.x, turned.y, turned.z, turned.w};
}

GltfAnimations::GltfAnimations(const GltfFile& file, const GltfNodes& nodes) : file_(file), nodes_(nodes) {
  const GltfValue animations = file.list("animations");
  for (std::size_t a = 0; a < animations.size(); ++a) {
    const GltfValue list = animations.item(a).member("channels");
    for (std::size_t c = 0; c < list.size(); ++c) {
      const GltfValue target = list.item(c).member("target"), node = target.member("node");
      const std::string path = target.member("path").text();
      if (node && (path == "translation" || path == "rotation" || path == "scale"))
        channels_[node.index(nodes.all.size(), "nodes")].try_emplace(path, Channel{a, c});
    }
  }
}

bool GltfAnimations::moves(std::size_t node) const {
  for (std::optional<std::size_t> at = node; at; at = nodes_.all[*at].over)
    if (channels_.contains(*at)) return true;
  return false;
}

GltfTrack::Numbers GltfAnimations::numbers(const GltfValue& accessor, std::size_t width) {
  const std::size_t index = accessor.index(file_.list("accessors").size(), "accessors");
  GltfTrack::Numbers& known = numbers_[{index, width}];
  if (!known) known = std::make_shared<const std::vector<float>>(file_.numbers(index, width));
  return known;
}

GltfTrack GltfAnimations::readTrack(const Channel& from, std::size_t width) {
  const GltfValue animation = file_.list("animations").item(from.animation), samplers = animation.member("samplers");
  const GltfValue channel = animation.member("channels").item(from.channel);
  const GltfValue sampler = samplers.item(channel.member("sampler").index(samplers.size(), "samplers"));
  GltfTrack track;
  track.width = width;
  track.interpolation = interpolationOf(sampler.member("interpolation"));
  track.times = numbers(sampler.member("input"), 1);
  track.values = numbers(sampler.member("output"), width);
  requireAscending(sampler.member("input"), *track.times);
  const std::size_t values = track.times->size() * (track.interpolation == Interpolation::Cubic ? 3 : 1);
  if (track.values->size() != values * width)
    sampler.member("output").refuse(fmt::format("{} values", values), fmt::format("{}", track.values->size() / width));
  return track;
}

void GltfAnimations::load(std::size_t node) {
  for (std::optional<std::size_t> at = node; at; at = nodes_.all[*at].over) {
    const auto found = channels_.find(*at);
    if (found == channels_.end() || tracks_.contains(*at)) continue;
    const GltfValue value = nodes_.value(file_, *at);
    if (nodes_.all[*at].matrix)
      value.member("matrix").refuse("translation, rotation and scale, as the node is animated", "a matrix");
    Tracks& tracks = tracks_[*at];
    for (const auto& [path, channel] : found->second) {
      const GltfTrack track = readTrack(channel, path == "rotation" ? 4 : 3);
      const double first = static_cast<double>(track.times->front()), last = static_cast<double>(track.times->back());
      const bool none = span_.x > span_.y;
      span_ = {none ? first : std::min(span_.x, first), none ? last : std::max(span_.y, last)};
      (path == "translation" ? tracks.translation : path == "rotation" ? tracks.rotation : tracks.scale) = track;
    }
  }
}

GltfPose GltfAnimations::poseAt(std::size_t node, double time, double snap) const {
  GltfPose pose = nodes_.all[node].pose;
  const auto found = tracks_.find(node);
  if (found == tracks_.end()) return pose;
  const auto& [translation, rotation, scale] = found->second;
  if (translation) pose.translation = dvec3(translation->at(time, snap));
  if (scale) pose.scale = dvec3(scale->at(time, snap));
  if (!rotation) return pose;
  const glm::dquat turned = quaternion(rotation->at(time, snap));
  if (!(glm::length(turned) > 0))
    nodes_.value(file_, node).refuse("a rotation that is not zero", fmt::format("zero at {} s", time));
  pose.rotation = glm::normalize(turned);
  return pose;
}

dmat4 GltfAnimations::worldAt(std::size_t node, double time, double snap) const {
  dmat4 world(1);
  for (std::optional<std::size_t> at = node; at; at = nodes_.all[*at].over) {
    const GltfNode& each = nodes_.all[*at];
    world = (each.matrix ? *each.matrix : poseAt(*at, time, snap).matrix()) * world;
  }
  return world;
}

}  // namespace mote
