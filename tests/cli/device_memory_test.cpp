// --device-memory: frames larger than what the device may hold, and limits that are none or too low.
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Arguments = std::vector<std::string>;

/// 20,000 particles in colours with all layers, and a wall: everything that is held on the device.
constexpr const char* kScene = R"({
  "particles": [{"generate": "ball", "count": 20000}],
  "medium": {"optical_depth": 3, "extinction": [0.5, 1, 1.5]},
  "lights": [{"name": "lamp", "type": "point", "position": [2, 2, 2], "intensity": 60},
             {"name": "sun", "type": "directional", "direction": [0.3, -1, -0.4], "irradiance": 3}],
  "lighting": {"cutoff": 0},
  "solids": [{"name": "wall", "file": "wall.obj"}],
  "camera": {"position": [1, 1.5, 4.5], "target": [0, 0, 0], "fov": 35, "near": 0.1, "far": 50},
  "output": {"size": [80, 45], "aovs": ["Z", "lights", "optical_depth", "shadow"]}
})";

class DeviceMemory : public testing::Test {
 protected:
  DeviceMemory() {
    writeBytes(folder_.file("wall.obj"), "v -1 -1 0.3\nv 1 -1 0.2\nv 0 1 0.4\nf 1 2 3\n");
    writeBytes(folder_.file("scene.json"), kScene);
  }
  std::string scene() const { return folder_.file("scene.json"); }
  ProcessResult render(const std::string& lighting, const std::string& raster, const Arguments& more) const {
    Arguments arguments{"render", scene(),   "--lighting", lighting, "--raster",
                        raster,   "--stats", stats(),      "-o",     output()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return mote(arguments, kOnLavapipe);
  }
  std::string stats() const { return folder_.file("stats.json"); }
  std::string output() const { return folder_.file("out.exr"); }
  std::uint64_t deviceBytes() const {
    std::ifstream file(stats());
    return nlohmann::json::parse(file)["frames"][0]["bytes"]["device"].get<std::uint64_t>();
  }

  TempFolder folder_;
};

TEST_F(DeviceMemory, CrosscheckPassesWithATreeInParts) {
  const ProcessResult result =
      mote({"crosscheck", scene(), "--device-memory", "2500K", "--validate", "-v"}, kOnLavapipe);
  EXPECT_EQ(result.exitCode, 0) << result.out << result.err;
  EXPECT_TRUE(contains(result.out, "sort: 20000 particles: identical"));
  EXPECT_TRUE(contains(result.err, "octree: "));
}

TEST_F(DeviceMemory, PicturesInPartsAreTheSame) {
  // Light by the host: what the device draws must then be the same to the last bit.
  ASSERT_EQ(render("cpu", "gpu", {}).exitCode, 0);
  const Image a = readExr(output());
  const std::uint64_t wholeBytes = deviceBytes();
  const ProcessResult result = render("cpu", "gpu", {"--device-memory", "600K", "-v"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  for (const char* parts : {"depth order: ", "splats: "}) EXPECT_TRUE(contains(result.err, parts));
  EXPECT_GT(wholeBytes, 20000u * 56) << "all of it at once";
  EXPECT_LE(deviceBytes(), 600u * 1024);
  EXPECT_GT(deviceBytes(), 300u * 1024);
  const Image b = readExr(output());
  EXPECT_TRUE(a.pixels == b.pixels);
  EXPECT_TRUE(a.depth == b.depth);
  EXPECT_TRUE(a.alpha == b.alpha);
  EXPECT_TRUE(a.opticalDepth == b.opticalDepth);
  ASSERT_EQ(a.layers.size(), b.layers.size());
  ASSERT_GE(a.layers.size(), 6u);
  for (std::size_t k = 0; k < a.layers.size(); ++k) EXPECT_TRUE(a.layers[k].values == b.layers[k].values) << k;
}

TEST_F(DeviceMemory, TooLittleIsTheMachinesFailureWithTheNumbers) {
  for (const char* lighting : {"gpu", "cpu"}) {
    const ProcessResult result = render(lighting, "gpu", {"--device-memory", "40000"});
    EXPECT_EQ(result.exitCode, 3);
    EXPECT_TRUE(contains(result.err, " of the 40000 that may be held"));
    EXPECT_TRUE(contains(result.err, "--device-memory"));
    EXPECT_TRUE(contains(result.err, " bytes"));
    EXPECT_FALSE(std::filesystem::exists(output()));
  }
}

TEST_F(DeviceMemory, WhatIsNoLimitIsBadInput) {
  for (const char* text : {"0", "-1", "x", "5X", "1 G", "512MB", "0%", "101%", "nan", "inf", "1e3", "0x10", "9000T"})
    for (const char* where : {"gpu", "cpu"}) {
      const ProcessResult result = render("cpu", where, {"--device-memory", text});
      EXPECT_EQ(result.exitCode, 2) << text;
      EXPECT_TRUE(contains(result.err, "--device-memory")) << text;
      EXPECT_TRUE(contains(result.err, std::string("\"") + text + "\"")) << text;
    }
  writeBytes(scene(), R"({"particles": [{"generate": "ball", "count": 200}]})");
  for (const char* text : {"1.5G", "80%", "100%", "999T", "3000000", "2600K"})
    EXPECT_EQ(render("gpu", "gpu", {"--device-memory", text, "--size", "16x9"}).exitCode, 0) << text;
}

}  // namespace
}  // namespace mote::test
