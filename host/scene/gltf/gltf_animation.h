// What moves in a glTF: a node's place at a time, by the animations of the file.
//
// Source: glTF 2.0 Specification, §3.11 "Animations" and appendix C "Animation Sampler Interpolation Modes".
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/scene/gltf/gltf_file.h"
#include "host/scene/gltf/gltf_nodes.h"

namespace mote {

/// One property of one node over time: key times [s], strictly ascending and finite, and values between them.
struct GltfTrack {
  enum class Interpolation { Step, Linear, Cubic };
  using Numbers = std::shared_ptr<const std::vector<float>>;  // tracks may share an accessor
  Interpolation interpolation = Interpolation::Linear;
  std::size_t width = 3;  ///< numbers of a value: 3, or 4 of a rotation (x, y, z, w)
  Numbers times;          ///< not empty
  Numbers values;         ///< a value a time; Cubic: tangent before, value, tangent after

  /// Before the first time and after the last, their values. A time within `snap` seconds of a key's is that key's:
  /// exporters round frames to seconds in single precision.
  glm::dvec4 at(double time, double snap) const;
};

/// All animations of the file together: exporters make one of each object.
class GltfAnimations {
 public:
  /// Reads which nodes move, not yet how. Throws InputError for indices out of range. Of two animations of the same
  /// property of a node the first counts.
  explicit GltfAnimations(const GltfFile& file, const GltfNodes& nodes);

  /// The node, or one that it stands under, moves.
  bool moves(std::size_t node) const;

  /// Reads the tracks of a node and of those that it stands under. Throws InputError for accessors as
  /// GltfFile::numbers, times out of order, and a node with both a matrix and an animation.
  void load(std::size_t node);
  /// First and last time of the tracks that were loaded [s].
  dvec2 span() const { return span_; }
  /// How many nodes have loaded tracks.
  std::size_t loadedNodes() const { return tracks_.size(); }
  /// The node's transform at a time [s]; its tracks, and those above it, must be loaded.
  dmat4 worldAt(std::size_t node, double time, double snap) const;

 private:
  struct Channel {
    std::size_t animation, channel;
  };
  struct Tracks {
    std::optional<GltfTrack> translation, rotation, scale;
  };
  GltfTrack::Numbers numbers(const GltfValue& accessor, std::size_t width);
  GltfTrack readTrack(const Channel& channel, std::size_t width);
  GltfPose poseAt(std::size_t node, double time, double snap) const;

  const GltfFile& file_;
  const GltfNodes& nodes_;
  std::map<std::size_t, std::map<std::string, Channel>> channels_;  // by node, then by property
  std::map<std::size_t, Tracks> tracks_;
  std::map<std::pair<std::size_t, std::size_t>, GltfTrack::Numbers> numbers_;  // by accessor and width
  dvec2 span_{1, 0};
};

}  // namespace mote
