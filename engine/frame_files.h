// What a frame of a scene has from files and generators, loaded while the frame before is drawn.
#pragma once
#include <future>
#include <string>
#include <vector>

#include "engine/stats.h"
#include "host/particles/particle_set.h"
#include "host/scene/scene.h"
#include "host/solids/mesh.h"
#include "host/splat/splat_set.h"

namespace mote {

/// What a frame is made for: the light alone needs no sprites.
enum class FramePurpose { Picture, Light };

/// What a frame has from files and generators.
struct FrameFiles {
  int number = 1;
  ParticleSet particles;
  std::vector<Mesh> meshes;
  SplatSet sprites;
  std::vector<FrameInput> inputs;
  std::vector<std::string> warnings;
  double seconds = 0;  ///< that loading took
};

/// Loads them. Of the scene it looks at sources, solids, view, density mode, frame rate, origin, imported files and rules
/// for inputs only. Throws InputError as readers do; warnings are in the result, not yet logged.
FrameFiles loadFrame(const Scene& scene, int number, FramePurpose purpose);

/// Loads a run's frames in turn, each while the one before is lit and drawn: with more than one thread, and particles
/// for two frames at once.
class FrameLoader {
 public:
  /// `scene` must outlive it.
  explicit FrameLoader(const Scene& scene, FramePurpose purpose = FramePurpose::Picture)
      : scene_(scene), purpose_(purpose) {}

  /// The frame's files, at hand or loaded now. Throws as loadFrame.
  FrameFiles take(int number);
  /// Begins to load what take(number) will be asked for next. The scene must not change until then.
  void prefetch(int number);

 private:
  const Scene& scene_;
  FramePurpose purpose_;
  int number_ = 0;
  std::future<FrameFiles> next_;
};

}  // namespace mote
