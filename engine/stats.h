// What a frame was made from and what it cost: `--stats`, reports and EXR headers (SCENE.md).
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/lighting/approximate.h"
#include "host/particles/particle_set.h"

namespace mote {

struct FrameInput {
  std::string file, sha256;
};

/// How one light's shadows in the medium were computed.
struct LightMethod {
  std::string light;
  Approximation how;
};

struct FrameStats {
  int frame = 1;
  /// Where it was made: "cpu" or "gpu"; "gpu, cpu" where the device failed between particles and solids (recovery.h).
  std::string lighting, raster;
  std::optional<int> settledBy;  ///< the frame that settled what the scene leaves open; none: nothing was open
  std::size_t particles = 0, inOctree = 0, lights = 0;
  std::size_t drawn = 0;  ///< particles in view: sorted and splatted
  /// Wall clock: load (particles, meshes, sprites, their sums; may have gone on while the frame before was drawn, and
  /// is then no part of total), octree (with calibration and "auto" sub-sampling), lighting (of particles and
  /// surfaces), sort, splat, write, total; solids (tree, camera rays, compositing) where there are any.
  std::map<std::string, double> seconds;
  std::map<std::string, double> deviceSeconds;  ///< the GPU's own clock (timestamps): lighting, sort, splat
  std::uint64_t deviceBytes = 0;                ///< most device memory held at once, of lighting and drawing
  double densityScale = 1;
  double subsample = 1;                  ///< share of the particles in the octree …
  std::optional<double> subsampleError;  ///< … and its mean |ΔT|: 0 for all, else empty unless measured on this frame
  RadiusRange radius;
  dvec3 origin{0};                   ///< what coordinates are measured from, those of the EXR header's matrices too
  std::vector<LightMethod> methods;  ///< of the particles' light; empty where nothing but exact sums was allowed
  std::vector<FrameInput> inputs;
  std::vector<std::string> warnings;
};

struct FailedFrame {
  int frame = 1;
  std::string error;  ///< the sentence
};

struct RunStats {
  std::string device = "none";   ///< Vulkan device in use
  std::string lighting, raster;  ///< "cpu" or "gpu", as it was chosen before the first frame
  unsigned threads = 0;
  std::optional<int> settledBy;    ///< the frame that settled what the scene leaves open; none: none did yet
  std::string settings;            ///< SHA-256 of everything but the input files that a picture may depend on
  std::vector<FrameStats> frames;  ///< that were written
  std::vector<FailedFrame> failed;
  std::vector<int> skipped;  ///< that were there already (--resume)
};

/// Most memory this process ever held [bytes].
std::uint64_t peakResidentBytes();

/// The whole run as SCENE.md's JSON.
std::string statsJson(const RunStats& run);

/// One frame without what differs from run to run (seconds, memory): for EXR headers, so that equal input gives equal
/// bytes.
std::string reproducibleStatsJson(const FrameStats& frame);

}  // namespace mote
