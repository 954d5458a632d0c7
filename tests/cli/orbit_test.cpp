// Temporal coherence of whole pictures (Monette 2011, §4.3): a camera that circles a cloud sees it turn, not flicker.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/image/exr.h"
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

/// Greatest over median difference of neighbouring frames of the orbit, rendered with `settings`.
double spike(const std::vector<std::string>& settings) {
  const TempFolder folder;
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
  const ProcessResult result = mote(arguments, kWithoutVulkan);
  EXPECT_EQ(result.exitCode, 0) << result.err;

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
// ratios are below 1.2. A frame in which the light, the order or the size of splats jumped would stand out by far more.
TEST(Orbit, FrameDifferencesHaveNoSpikes) { EXPECT_LT(spike({}), 1.5); }

TEST(Orbit, SubsampledLightingDoesNotFlickerEither) { EXPECT_LT(spike({"/lighting/subsample=0.2"}), 1.5); }

TEST(Orbit, MotionBlurAndDepthOfFieldKeepItSmooth) {
  EXPECT_LT(spike({"/camera/shutter=[-0.01, 0.01]", "/camera/aperture_radius=0.05", "/camera/focus_distance=4"}), 1.5);
}

}  // namespace
}  // namespace mote::test
