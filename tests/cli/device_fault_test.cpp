// Batches on devices that fail, as MOTE_FAULTS makes them.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/image/compare.h"
#include "host/image/exr.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Json = nlohmann::json;

/// Three frames of a plume; --lighting and --raster auto unless something else is said.
class DeviceFault : public testing::Test {
 protected:
  DeviceFault() {
    writeBytes(folder_.file("scene.json"), R"({"particles": [{"generate": "plume", "count": 2000}],
      "medium": {"density_scale": 0.001}, "output": {"size": [48, 32], "precision": "float"},
      "camera": {"position": [0, 1, 6], "target": [0, 1, 0]}, "lights": [{"name": "key", "position": [2, 3, 1]}]})");
  }

  /// lavapipe passes for hardware, so that auto takes it.
  ProcessResult render(const std::string& faults, std::vector<std::string> more = {}) const {
    ProcessOptions options = kOnLavapipe;
    options.environment["MOTE_FAULTS"] = faults;
    options.environment["MOTE_LIMITS"] = "deviceType=discrete";
    std::vector<std::string> arguments{"render",  folder_.file("scene.json"), "--validate", "--frames", "1-3",
                                       "--stats", folder_.file("stats.json")};
    if (more.empty() || more[0] != "--lighting")
      arguments.insert(arguments.end(), {"--lighting", "auto", "--raster", "auto"});
    arguments.insert(arguments.end(), {"-o", picture("#")});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return mote(arguments, options);
  }
  std::string picture(const std::string& frame) const { return folder_.file("p." + frame + ".exr"); }
  Json stats() const { return Json::parse(readBytes(folder_.file("stats.json"))); }
  Json header(int frame) const { return Json::parse(exrStrings(picture(std::to_string(frame))).at("mote:stats")); }
  bool exists(int frame) const { return std::filesystem::exists(picture(std::to_string(frame))); }
  void expectPicturesAsOnTheCpu() const {
    std::vector<Image> images;
    for (const char* frame : {"1", "2", "3"}) images.push_back(readExr(picture(frame)));
    ASSERT_EQ(mote({"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu", "--frames", "1-3",
                    "-o", folder_.file("cpu.#.exr")},
                   kWithoutVulkan)
                  .exitCode,
              0);
    for (const int frame : {1, 2, 3}) {
      const Image host = readExr(folder_.file("cpu." + std::to_string(frame) + ".exr"));
      EXPECT_TRUE(failuresOf(compareImages(images[static_cast<std::size_t>(frame - 1)], host)).empty()) << frame;
    }
  }

  TempFolder folder_;
};

TEST_F(DeviceFault, ALostDeviceCostsOneWarningAndTheHeaderHasIt) {
  const ProcessResult result = render("lost@6");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.err, "lighting on the GPU, picture on the GPU"));
  int warnings = 0;
  const Json all = stats();
  for (const int frame : {1, 2, 3}) {
    const Json own = header(frame);
    EXPECT_EQ(own["lighting"], "gpu");
    EXPECT_EQ(own["raster"], "gpu");
    EXPECT_EQ(own["warnings"], all["frames"][frame - 1]["warnings"]);
    for (const Json& warning : own["warnings"]) {
      ++warnings;
      EXPECT_TRUE(contains(warning.get<std::string>(), "frame " + std::to_string(frame) + ": "));
      EXPECT_TRUE(contains(warning.get<std::string>(), "opened anew"));
      EXPECT_TRUE(contains(result.err, "warning: " + warning.get<std::string>() + "\n"));
    }
  }
  EXPECT_EQ(warnings, 1);
  expectPicturesAsOnTheCpu();
}

TEST_F(DeviceFault, AfterASecondLossTheRestOfTheRunIsOnTheCpuAndResumeTakesItForDone) {
  const ProcessResult result = render("lost@9x1000");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const Json all = stats();
  EXPECT_EQ(all["lighting"], "gpu") << "as it was chosen";
  int warnings = 0, onDevice = 0;
  bool left = false;
  for (const int frame : {1, 2, 3}) {
    const Json own = header(frame);
    for (const Json& warning : own["warnings"]) {
      ++warnings;
      EXPECT_TRUE(contains(warning.get<std::string>(), "done on the CPU, as all later frames are"));
    }
    left = left || !own["warnings"].empty();
    if (left) {
      EXPECT_EQ(own["raster"], "cpu") << frame;
    } else {
      EXPECT_EQ(own["raster"], "gpu") << frame;
      ++onDevice;
    }
  }
  EXPECT_EQ(warnings, 1);
  EXPECT_GT(onDevice, 0);
  EXPECT_EQ(header(3)["lighting"], "cpu");
  expectPicturesAsOnTheCpu();

  for (const char* faults : {"", "lost@1x1000"}) {
    ASSERT_EQ(render(faults, {"--resume"}).exitCode, 0);
    EXPECT_EQ(stats()["skipped"], (std::vector<int>{1, 2, 3})) << "where they were to be made is what counts";
  }
}

TEST_F(DeviceFault, WhereTheDeviceWasAskedForItsFrameFailsAndTheNextBeginsAnew) {
  const ProcessResult result = render("lost@1x2", {"--lighting", "gpu", "--raster", "gpu"});
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_TRUE(contains(result.err, "mote: frame 1: lighting on "));
  EXPECT_TRUE(contains(result.err, "--lighting auto and --raster auto go on on the CPU"));
  EXPECT_TRUE(contains(result.err, "mote: 1 of 3 frames failed:"));
  EXPECT_FALSE(exists(1));
  EXPECT_TRUE(exists(2) && exists(3));
  EXPECT_EQ(header(2)["lighting"], "gpu");
}

TEST_F(DeviceFault, MemoryThatRunsOutIsSaidOnce) {
  const ProcessResult parts = render("memory@4");
  ASSERT_EQ(parts.exitCode, 0) << parts.err;
  EXPECT_TRUE(contains(parts.err, "frame 1: lighting on "));
  EXPECT_TRUE(contains(parts.err, "; repeated in parts that hold at most "));
  EXPECT_EQ(header(1)["warnings"].size() + header(2)["warnings"].size() + header(3)["warnings"].size(), 1u);
  expectPicturesAsOnTheCpu();
  ASSERT_EQ(render("memory@1x100000").exitCode, 0);
  EXPECT_EQ(header(1)["warnings"].size(), 2u) << "lighting, picture";
  EXPECT_EQ(header(2)["warnings"].size() + header(3)["warnings"].size(), 0u);
  EXPECT_EQ(header(1)["raster"], "cpu");
}

TEST_F(DeviceFault, WhatIsNoFaultIsBadInput) {
  const ProcessResult result = render("lost");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, "MOTE_FAULTS"));
}

}  // namespace
}  // namespace mote::test
