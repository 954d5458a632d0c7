// A scene as plain data: what ../../scenes/scene.schema.json describes, parsed, checked and with every default filled
// in. Angles in degrees, lengths in scene units, times in seconds. Nothing here opens a particle file.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/core/vec.h"

namespace mote {

/// How a particle source's support radius is chosen.
struct RadiusRule {
  enum class Kind { Auto, Number, Channel };
  Kind kind = Kind::Auto;  ///< Auto: the file's Radius channel if it has one, else 1.5 × mean distance to the nearest 8
  float value = 0;         ///< Number: the radius [scene units], > 0
  std::string channel = "Radius";  ///< Channel: its name in the file
  float scale = 1;                 ///< Channel: factor, > 0

  bool operator==(const RadiusRule&) const = default;
};

enum class Generator { None, Ball, Cloud, Plume };

/// Which axis of a file points up; ours is y. File: as its metadata say, mirrored where they are left-handed.
enum class UpAxis { Y, Z, File };

/// How long a file's unit is. Where it is known lengths become metres.
struct LengthUnit {
  bool fromFile = false;  ///< as its metadata say
  double metres = 1;      ///< else this, > 0

  bool operator==(const LengthUnit&) const = default;
};

enum class VelocityTime { Second, Frame };

/// Where a particle is while the shutter is open: on along its velocity, or on the curve to where it is in the frames
/// before and after.
enum class Interpolation { Velocity, Hermite };

struct ParticleSource {
  std::string pointer;  ///< where it stands in the scene, "/particles/0": the place of messages
  std::string file;     ///< path as opened (relative paths resolved), may hold #### or %04d; empty if generated
  Generator generate = Generator::None;
  std::uint64_t count = 0;  ///< particles to generate, or to draw from a volume, 1 … 4e9; 0: not said, of a file
  std::uint64_t seed = 0;
  std::string grid;  ///< of a file with several: which; empty: not said
  RadiusRule radius;
  std::map<std::string, std::string> channels;      ///< ours → theirs
  std::optional<UpAxis> up;                         ///< of the file; none: y
  std::optional<LengthUnit> unit;                   ///< of the file; none: as long as the scene's
  VelocityTime velocityPer = VelocityTime::Second;  ///< what the file's velocities are per
  Interpolation interpolate = Interpolation::Velocity;
  float density = 1;  ///< used where the file has no Density
  vec3 color{1};      ///< used where the file has no Color
  dvec3 translate{0};
  vec3 rotate{0};   ///< degrees about x, then y, then z; order: scale, rotate, translate
  float scale = 1;  ///< > 0; radii and velocities scale with it, cross-sections with its square

  bool operator==(const ParticleSource&) const = default;
};

enum class DensityMode { CrossSection, Peak };
enum class Falloff { Smooth, Linear, Sphere };
enum class Endpoint { Soft, Clamp };
enum class PhaseType { Isotropic, HenyeyGreenstein, Rayleigh };

struct Phase {
  PhaseType type = PhaseType::Isotropic;
  float g = 0;  ///< Henyey–Greenstein: mean cosine, −1 < g < 1, > 0 forward

  bool operator==(const Phase&) const = default;
};

struct Medium {
  DensityMode densityMode = DensityMode::CrossSection;
  float densityScale = 1;             ///< ≥ 0
  std::optional<float> opticalDepth;  ///< instead of densityScale: mean τ of straight lines through the particles, > 0
  Falloff falloff = Falloff::Smooth;
  vec3 albedo{0.95f};  ///< 0–1, multiplies Color
  vec3 extinction{1};  ///< ≥ 0, multiplies the extinction cross-section per channel
  Phase phase;
  float emissionScale = 1;  ///< ≥ 0, multiplies Emission

  bool operator==(const Medium&) const = default;
};

enum class LightType { Point, Spot, Directional };

struct LightSource {
  std::string name;  ///< unique; letters, digits, '_' (it becomes a channel name)
  LightType type = LightType::Point;
  dvec3 position{0};         ///< point, spot
  vec3 direction{0, -1, 0};  ///< directional, spot (from position to target): of travel; unit length after parsing
  float innerAngle = 20;     ///< spot: half angle up to which it is at full strength [degrees], 0 ≤ inner ≤ outer
  float outerAngle = 30;     ///< spot: half angle beyond which there is nothing [degrees], 0 < outer < 180
  vec3 color{1};             ///< ≥ 0
  float strength = 1;        ///< point, spot: intensity [W/sr]; directional: irradiance [W/m²]; ≥ 0
  float decay = 2;           ///< point, spot: 0–2
  float shadowDensity = 1;   ///< ≥ 0
  bool castsShadows = true;

  bool operator==(const LightSource&) const = default;
};

enum class Backend { Auto, Cpu, Gpu };

struct LightingSettings {
  Backend backend = Backend::Auto;
  float cutoff = 1e-4f;  ///< 0 ≤ cutoff < 1: a ray may stop once its transmittance is below
  Endpoint endpoint = Endpoint::Soft;
  float radiusScale = 1;               ///< > 0: factor on the radii that shadows are computed with (§4.6.4)
  std::uint32_t particlesPerCell = 0;  ///< 0: auto
  float subsample = 1;                 ///< share of the particles in the octree, 0 < share ≤ 1 (§4.6.3)
  bool autoSubsample = false;          ///< true: the smallest share whose mean |ΔT| is within `error`
  std::uint64_t subsampleSeed = 0;
  bool compensate = true;          ///< the octree's particles stand for all: the total cross-section stays
  float error = 0;                 ///< 0: exact; else the mean |ΔT| that approximations must keep; 0–1
  float solidShadowIntensity = 1;  ///< 0–1: share of the light that a solid in its way takes (§4.6.2)

  bool operator==(const LightingSettings&) const = default;
};

enum class SolidMode { Shaded, Holdout, Hidden };

/// A mesh that stands in the medium.
struct Solid {
  std::string pointer;  ///< where it stands in the scene, "/solids/0": the place of messages
  std::string name;     ///< unique; letters, digits, '_'
  std::string file;     ///< path as opened; may hold ####
  /// The only node of a glTF file that counts: its place in the scene, depth first from 0, or from 1 where the scene
  /// has not one root but several. None: all of the file.
  std::optional<std::uint32_t> node = std::nullopt;
  SolidMode mode = SolidMode::Shaded;  ///< in the picture: Lambert; cut out of the medium; not at all
  vec3 albedo{0.5f};                   ///< 0–1
  bool castsShadows = true, receivesShadows = true;
  dvec3 translate{0};  ///< as a particle source's
  vec3 rotate{0};
  float scale = 1;  ///< > 0

  bool operator==(const Solid&) const = default;
};

enum class Projection { Perspective, Orthographic };

/// What the camera is at one frame; between keys it moves smoothly (camera_path.h).
struct CameraKey {
  float frame = 1;  ///< may be fractional
  std::optional<dvec3> position = std::nullopt, target = std::nullopt;
  std::optional<vec3> up = std::nullopt;
  std::optional<float> fov = std::nullopt, height = std::nullopt, focusDistance = std::nullopt;

  bool operator==(const CameraKey&) const = default;
};

struct Camera {
  Projection projection = Projection::Perspective;
  bool fitted = false;        ///< true: no position and no target, in no key either; fitDefaults() places it by the box
  bool fittedDepths = false;  ///< true: fitted, and neither near nor far given; fitDefaults() sets both
  bool fittedHeight = false;  ///< true: fitted, orthographic, and no height given; fitDefaults() sets it
  dvec3 position{0, 1, 4}, target{0, 0.5, 0};
  vec3 up{0, 1, 0};
  float fov = 40;                      ///< perspective: vertical, 0 < fov < 180
  float height = 2;                    ///< orthographic: of the picture [scene units], > 0
  float near = 0.01f, far = 1000;      ///< depths; particles whose centre lies outside are not drawn
  vec2 shutter{0};                     ///< opens and closes, relative to the frame's time [s]; open ≤ close
  float apertureRadius = 0;            ///< of the lens [scene units], ≥ 0; 0: everything is sharp
  std::optional<float> focusDistance;  ///< depth that is sharp [scene units], > 0; none: that of the target
  std::vector<CameraKey> keys;         ///< strictly ascending frames; empty: the camera stands still

  bool operator==(const Camera&) const = default;
};

struct View {
  Backend backend = Backend::Auto;
  float radiusScale = 1;                   ///< > 0: factor on the radii that are drawn
  std::string spriteColor, spriteOpacity;  ///< PNG or EXR over each splat, paths as opened; empty: none

  bool operator==(const View&) const = default;
};

enum class Precision { Half, Float };
enum class Compression { None, Rle, Zips, Zip, Piz };

struct Output {
  std::string file = "mote.####.exr";  ///< relative to the working folder if from a flag, else to the scene
  ivec2 size{1280, 720};               ///< 1 … 16384 each
  Precision precision = Precision::Half;
  Compression compression = Compression::Zip;
  float pixelAspect = 1;  ///< width / height of a pixel, > 0
  /// Layers asked for in "aovs".
  bool depth = false, shadow = false, lights = false, velocity = false, opticalDepth = false;

  bool operator==(const Output&) const = default;
};

struct Frames {
  int first = 1, last = 1, step = 1;  ///< last ≥ first, step ≥ 1
  float fps = 24;

  bool operator==(const Frames&) const = default;
};

/// A frame without a file: an error, or the nearest earlier file stands for it.
enum class MissingFrames { Error, Hold };

/// What is done with files that are not as they should be: from flags, no part of a scene's text.
struct InputRules {
  bool strict = false;  ///< particles that are not finite or of no size are refused; else left out with a warning
  MissingFrames missing = MissingFrames::Error;

  bool operator==(const InputRules&) const = default;
};

struct Scene {
  std::string settings;               ///< sceneSettings of the file, as it was read
  std::string path;                   ///< as given; the place in messages
  std::vector<std::string> imported;  ///< files that "import" was read from, as opened
  std::vector<ParticleSource> particles;
  Medium medium;
  bool defaultLights = false;  ///< true: the scene gave no "lights"; one key light is fitted to the bounding box
  std::vector<LightSource> lights;
  LightingSettings lighting;
  std::vector<Solid> solids;
  Camera camera;
  View view;
  Output output;
  Frames frames;               ///< to be drawn
  std::optional<Frames> shot;  ///< the frames that the scene itself names, of which --frames may draw a part or others
  /// What float32 coordinates are measured from; none: what loadParticles finds best.
  std::optional<dvec3> origin;
  dvec3 movedBy{0};  ///< what has been taken off the places of camera and lights (moveOrigin)
  InputRules inputs;

  /// The frames of which a run may draw a part; those of the run where the scene names none.
  const Frames& wholeShot() const { return shot ? *shot : frames; }

  bool operator==(const Scene&) const = default;
};

}  // namespace mote
