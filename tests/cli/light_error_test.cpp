// lighting.error from the outside: which method each light got, as --stats and the header say, and what the device
// makes of it.
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using nlohmann::json;
using Arguments = std::vector<std::string>;

class LightError : public testing::Test {
 protected:
  void useScene(const std::string& text) const { writeBytes(folder_.file("scene.json"), text); }

  /// Renders to out.exr, drawn by the host so that pictures differ by their light alone; returns --stats.
  json render(const char* lighting, const Arguments& more = {}, const ProcessOptions& options = kWithoutVulkan) const {
    Arguments arguments{
        "render",  folder_.file("scene.json"), "--lighting", lighting, "--raster", "cpu", "-o", picture(),
        "--stats", folder_.file("stats.json")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = mote(arguments, options);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return result.exitCode == 0 ? json::parse(readBytes(folder_.file("stats.json"))) : json();
  }
  std::string picture() const { return folder_.file("out.exr"); }

  TempFolder folder_;
};

TEST_F(LightError, StatsAndHeaderSayHowEachLightKeptIt) {
  useScene(R"({
    "particles": [{"generate": "cloud", "count": 60000}],
    "lights": [{"name": "key", "position": [2, 3, 1]}, {"name": "fill", "position": [-2, 0, 1], "casts_shadows": false}],
    "lighting": {"error": 0.02}, "output": {"size": [64, 36]}})");
  const json stats = render("cpu");
  ASSERT_TRUE(stats.is_object());
  const json found = stats["frames"][0]["light_error"];
  ASSERT_EQ(found.size(), 2u);
  const json& key = found[0];
  EXPECT_EQ(key["light"], "key");
  EXPECT_EQ(key["method"], "light_grid");
  EXPECT_NEAR(key["allowed"].get<double>(), 0.02, 1e-8);
  EXPECT_GT(key["cell"].get<double>(), 0);
  EXPECT_GT(key["mean"].get<double>(), 0);
  EXPECT_LE(key["mean"].get<double>(), key["upper"].get<double>());
  EXPECT_LE(key["upper"].get<double>(), 0.02 + 1e-8);
  EXPECT_LE(key["p99"].get<double>(), key["max"].get<double>());
  EXPECT_EQ(key["probes"], 2048);
  EXPECT_EQ(found[1]["method"], "exact");
  EXPECT_TRUE(contains(readBytes(picture()), "light_grid"));
}

TEST_F(LightError, StatsNameLevelOfDetailWhereVeryManyOverlap) {
  // r of 8 mean distances to the neighbours, 5.34 times what "auto" takes. At 90,000 particles the probes cost more
  // than they save and light is exact; 110,000 take level of detail for every error from 0.0006 to 0.001.
  useScene(R"({
    "particles": [{"generate": "cloud", "count": 110000}], "lights": [{"name": "key", "position": [2, 3, 1]}],
    "lighting": {"radius_scale": 5.34, "error": 0.0008}, "output": {"size": [32, 18]}})");
  const json stats = render("cpu");
  ASSERT_TRUE(stats.is_object());
  const json& frame = stats["frames"][0];
  ASSERT_EQ(frame["light_error"].size(), 1u);
  const json& key = frame["light_error"][0];
  EXPECT_EQ(key["method"], "level_of_detail");
  EXPECT_GT(key["tolerance"].get<double>(), 0);
  EXPECT_GT(key["tree_particles"], 0);
  EXPECT_LT(key["tree_particles"], frame["in_octree"]) << "stand-ins took the place of particles";
  EXPECT_FALSE(key.contains("cell")) << "that is a grid's";
  EXPECT_GT(key["mean"].get<double>(), 0);
  EXPECT_LE(key["upper"].get<double>(), 0.0008 + 1e-8);
  EXPECT_TRUE(contains(readBytes(picture()), "level_of_detail"));
}

TEST_F(LightError, TheDevicesGridGivesTheHostsPicture) {
  useScene(R"({
    "particles": [{"generate": "cloud", "count": 60000}], "lights": [{"name": "key", "position": [2, 3, 1]}],
    "lighting": {"cutoff": 0, "error": 0.02}, "output": {"size": [64, 36], "precision": "float"}})");
  const json onHost = render("cpu");
  const Image host = readExr(picture());
  const json onDevice = render("gpu", {"--validate"}, kOnLavapipe);
  const Image device = readExr(picture());
  render("cpu", {"--set", "/lighting/error=0"});
  const Image exact = readExr(picture());
  render("cpu", {"--set", "/lights/0/casts_shadows=false"});
  const Image unshadowed = readExr(picture());
  ASSERT_TRUE(onHost.is_object() && onDevice.is_object());

  EXPECT_EQ(onDevice["lighting"], "gpu");
  const json &frame = onDevice["frames"][0], &key = frame["light_error"][0];
  EXPECT_EQ(key["method"], "light_grid");
  EXPECT_EQ(key["cell"], onHost["frames"][0]["light_error"][0]["cell"]);
  EXPECT_LE(key["upper"].get<double>(), 0.02 + 1e-8);
  // The probes are the host's and nothing was lit exactly: what the device's clock counted is the grid.
  EXPECT_GT(frame["device_seconds"]["lighting"].get<double>(), 0);

  // A pixel is a sum of T times what it would be without shadows, with weights ≥ 0. T of host and device differ by 2e-5
  // at most (light_grid_pass.h), so pixels by that share of the unshadowed one; 1e-6 of it for sums in float.
  double worst = 0, ofTheGrid = 0;
  ASSERT_EQ(device.pixels.size(), 64u * 36u);
  for (std::size_t i = 0; i < device.pixels.size(); ++i) {
    EXPECT_EQ(device.pixels[i].a, host.pixels[i].a);
    for (int c = 0; c < 3; ++c) {
      const double whole = unshadowed.pixels[i][c];
      if (whole == 0) {
        EXPECT_EQ(device.pixels[i][c], 0);
        continue;
      }
      worst = std::max(worst, std::abs(double(device.pixels[i][c]) - host.pixels[i][c]) / whole);
      ofTheGrid = std::max(ofTheGrid, std::abs(double(device.pixels[i][c]) - exact.pixels[i][c]) / whole);
    }
  }
  std::printf("of the unshadowed pixel: device to host %.2e, grid to exact sums %.2e\n", worst, ofTheGrid);
  EXPECT_LE(worst, 2e-5 + 1e-6);
  EXPECT_GT(ofTheGrid, 1e-3) << "the device lit within the error, not exactly";
}

}  // namespace
}  // namespace mote::test
