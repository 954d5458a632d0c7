// The particles of one frame of a scene: sources read or generated, checked, moved into scene space and put together.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/particles/particle_set.h"
#include "host/scene/scene.h"

namespace mote {

/// What of a scene decides about its particles, beside their sources.
struct LoadRules {
  DensityMode densityMode = DensityMode::CrossSection;
  double framesPerSecond = 24;  ///< of velocities per frame
  vec2 shutter{0};              ///< opens and closes, relative to the frame [s]: what "hermite" interpolates for
  bool strict = false;          ///< what is no particle is refused, not left out
  MissingFrames missing = MissingFrames::Error;
  std::optional<dvec3> origin;  ///< what positions are measured from; none: what is best

  LoadRules() = default;
  LoadRules(DensityMode mode) : densityMode(mode) {}  ///< implicit: a mode alone is all that most callers have
  explicit LoadRules(const Scene& scene)
      : densityMode(scene.medium.densityMode),
        framesPerSecond(scene.frames.fps),
        shutter(scene.camera.shutter),
        strict(scene.inputs.strict),
        missing(scene.inputs.missing),
        origin(scene.origin) {}
};

/// Loads every source for `frame` ('####' in a file name is the frame, see framePath; what is done where there is none,
/// fileFrame) and merges them in order.
///
/// Our channels and what they are called in a file unless `ParticleSource::channels` says otherwise: Position (needed),
/// Radius, Density, Color, Absorption, Emission, Velocity, ID. Colours may be grey (arity 1). Without Density or Color
/// the source's `density` and `color` hold. Radius by the source's rule, in the file's own units: Auto takes the
/// channel Radius if there is one (a generator's own radii), else 1.5 × meanNeighbourDistance for all of the source.
/// Then the file's axes and unit where the source says so (file_units.h), scale, rotate about x, y, z and translate, in
/// double; radii, whatever their rule, and velocities scale along, and cross-sections with the square (in mode Peak:
/// densities stay); colour, absorption and emission stay.
///
/// Where only some sources have Color, Velocity, Emission or ID, the rest get their `color`, zero, zero, and the index
/// in the sources, one after the other. Where only some have Absorption, the rest get what Color leaves of 1, max(0, 1
/// − Color): their extinction is then Density where medium.albedo is 1, and smaller by Density · Color · (1 − albedo)
/// elsewhere. Give them the channel where that matters.
///
/// A source with Interpolation::Hermite also reads the files beside the frame's where the shutter is open, for its
/// particles' paths (sub_frames.h); the rest of the sources then have theirs along their velocities.
///
/// Positions are measured from `origin`, the same for all sources. Unless the rules name it that is (0, 0, 0), except
/// where float32's steps there are more than 1/1000 of the mean radius and the particles lie far enough off the scene's
/// 0 for another to be better (originOf): then that, with a warning. Positions in double, the source's `translate` and
/// all else are double until the origin has been subtracted.
///
/// Particles that are not finite or of no size are left out, with a warning for each source (particle_checks.h); where
/// no source has an ID, the rest get their index in the sources as one, so that what goes by it stays.
///
/// `openedFiles`, if given, gets the path of every file read. Throws InputError: a missing file (with the nearest names
/// or frames that exist), a channel that the file lacks (with those it has), no particles at all, none that is fit or
/// with `strict` any that is not (with its index and value), no spacing to take a radius from. Costs: that of the
/// reader, and 0.02 core-seconds for each million.
ParticleSet loadParticles(const std::vector<ParticleSource>& sources, int frame, const LoadRules& rules = {},
                          std::vector<std::string>* openedFiles = nullptr);

}  // namespace mote
