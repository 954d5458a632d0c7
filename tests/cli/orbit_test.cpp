// Temporal coherence of whole pictures (Monette 2011, §4.3): a camera that circles a cloud sees it turn, not flicker.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/core/random.h"
#include "host/image/exr.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

constexpr int kFrames = 48;

/// The circle as camera keys, one a frame, and one more on either side so that both ends curve as the rest.
std::string orbitKeys() {
  std::string keys;
  for (int frame = 0; frame <= kFrames + 1; ++frame) {
    const double angle = 2 * std::numbers::pi * frame / kFrames;
    keys += fmt::format(R"({}{{"frame": {}, "position": [{:.6f}, 0.6, {:.6f}]}})", frame > 0 ? ", " : "", frame,
                        4 * std::sin(angle), 4 * std::cos(angle));
  }
  return keys;
}

/// Mean |difference| of all channels of all pixels.
double meanDifference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c) sum += std::abs(double(a.pixels[i][c]) - double(b.pixels[i][c]));
  return sum / static_cast<double>(4 * a.pixels.size());
}

/// Renders the orbit, or `frames` of it, into the folder.
void renderOrbit(const TempFolder& folder, const std::vector<std::string>& settings, const std::string& frames = "") {
  writeBytes(folder.file("orbit.json"), fmt::format(R"({{
    "particles": [{{"generate": "cloud", "count": 30000, "seed": 3}}],
    "medium": {{"optical_depth": 6}},
    "lights": [{{"name": "sun", "type": "directional", "direction": [0.6, -0.7, 0.35], "irradiance": 10}}],
    "camera": {{"position": [0, 0.6, 4], "target": [0, 0, 0], "fov": 32, "keys": [{}]}},
    "output": {{"file": "orbit.####.exr", "size": [128, 96], "precision": "float"}},
    "frames": {{"first": 1, "last": {}}}
  }})",
                                                    orbitKeys(), kFrames));
  std::vector<std::string> arguments{"render", folder.file("orbit.json"), "--lighting", "cpu", "--raster", "cpu"};
  for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
  if (!frames.empty()) arguments.insert(arguments.end(), {"--frames", frames});
  const ProcessResult result = mote(arguments, kWithoutVulkan);
  EXPECT_EQ(result.exitCode, 0) << result.err;
}

/// Greatest over median difference of neighbouring frames of the orbit, rendered with `settings`.
double spike(const std::vector<std::string>& settings) {
  const TempFolder folder;
  renderOrbit(folder, settings);
  std::vector<double> steps;
  Image before = readExr(folder.file("orbit.0001.exr"));
  for (int frame = 2; frame <= kFrames; ++frame) {
    Image image = readExr(folder.file(fmt::format("orbit.{:04}.exr", frame)));
    steps.push_back(meanDifference(before, image));
    before = std::move(image);
  }
  std::sort(steps.begin(), steps.end());
  const double median = steps[steps.size() / 2];
  EXPECT_GT(median, 1e-3);  // it does turn: 7.5° a frame
  std::printf("orbit: greatest / median frame difference %.3f / %.3f = %.3f\n", steps.back(), median,
              steps.back() / median);
  return steps.back() / median;
}

// The cloud is 1.6 × 1.1 × 1.4 units, so its silhouette changes faster from some sides than from others; measured
// ratios are below 1.4. A frame in which the light, the order or the size of splats jumped would stand out by far more.
TEST(Orbit, FrameDifferencesHaveNoSpikes) { EXPECT_LT(spike({}), 1.5); }

TEST(Orbit, MotionBlurAndDepthOfFieldKeepItSmooth) {
  const std::string shutter = "/camera/shutter=[-0.01, 0.01]", lens = "/camera/aperture_radius=0.05",
                    focus = "/camera/focus_distance=4";
  EXPECT_LT(spike({shutter, lens, focus}), 1.5);
  // Both are there: without either the picture is another one, by more than a hundredth of a frame's turn (0.02).
  const auto frame = [&](const std::vector<std::string>& settings) {
    const TempFolder folder;
    renderOrbit(folder, settings, "7-7");
    return readExr(folder.file("orbit.0007.exr"));
  };
  const Image both = frame({shutter, lens, focus});
  const double withoutShutter = meanDifference(both, frame({lens, focus}));
  const double withoutLens = meanDifference(both, frame({shutter}));
  std::printf("orbit: without the shutter %.4f, without the lens %.4f off\n", withoutShutter, withoutLens);
  EXPECT_GT(withoutShutter, 2e-4);
  EXPECT_GT(withoutLens, 2e-4);
}

constexpr int kMoving = 2000, kMovingFrames = 12;

/// move.####.prt: a ball of particles that drifts and turns a little from frame to frame. The order in each file is
/// another one, as a simulation's may be; `named`: IDs say which particle is which.
void writeMovingBall(const TempFolder& folder, bool named) {
  for (int frame = 1; frame <= kMovingFrames; ++frame) {
    std::vector<vec3> position;
    std::vector<std::uint64_t> id;
    for (std::uint64_t k = 0; k < kMoving; ++k) {
      const std::uint64_t i = (k * 997 + static_cast<std::uint64_t>(frame) * 331) % kMoving;  // 997 is prime to 2,000
      Random random(8, i);
      const dvec3 p = random.direction() * std::cbrt(random.uniform());
      const double angle = 0.002 * frame;
      position.emplace_back(p.x * std::cos(angle) + p.z * std::sin(angle) + 0.002 * frame, p.y,
                            p.z * std::cos(angle) - p.x * std::sin(angle));
      id.push_back(i);
    }
    std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(position))};
    if (named) columns.push_back(PrtColumn::of("ID", std::span<const std::uint64_t>(id)));
    writePrt(folder.file(fmt::format("move.{:04}.prt", frame)), columns);
  }
}

/// Mean difference of neighbouring frames of the moving ball, lit by a share of it.
double meanStep(bool named, double share) {
  const TempFolder folder;
  writeMovingBall(folder, named);
  writeBytes(folder.file("move.json"), fmt::format(R"({{
    "particles": [{{"file": "move.####.prt", "radius": 0.15}}],
    "medium": {{"density_mode": "peak", "density_scale": 0.2}},
    "lights": [{{"name": "sun", "type": "directional", "direction": [0.6, -0.7, 0.35], "irradiance": 10}}],
    "camera": {{"position": [0, 0.6, 4], "target": [0, 0, 0], "fov": 36}},
    "lighting": {{"subsample": {}}},
    "output": {{"file": "move.####.exr", "size": [96, 72], "precision": "float"}},
    "frames": {{"first": 1, "last": {}}}
  }})",
                                                   share, kMovingFrames));
  const ProcessResult result =
      mote({"render", folder.file("move.json"), "--lighting", "cpu", "--raster", "cpu"}, kWithoutVulkan);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  double sum = 0;
  Image before = readExr(folder.file("move.0001.exr"));
  for (int frame = 2; frame <= kMovingFrames; ++frame) {
    Image image = readExr(folder.file(fmt::format("move.{:04}.exr", frame)));
    sum += meanDifference(before, image) / (kMovingFrames - 1);
    before = std::move(image);
  }
  return sum;
}

// The same particles cast the shadows in every frame, so that a moving cloud keeps its look. Were others chosen, as
// happens without IDs where the order changes, the light would jump at each frame.
TEST(Orbit, SubsampledLightingOfMovingParticlesDoesNotFlicker) {
  const double all = meanStep(true, 1), tenth = meanStep(true, 0.1), nameless = meanStep(false, 0.1);
  std::printf("moving ball: mean frame difference %.5f with all, %.5f with a tenth, %.5f without IDs\n", all, tenth,
              nameless);
  EXPECT_GT(all, 0);
  EXPECT_LT(tenth, 1.3 * all);
  EXPECT_GT(nameless, 2 * tenth) << "the test would not see a flicker";
}

}  // namespace
}  // namespace mote::test
