// Devices that lack something that Mote needs, as MOTE_LIMITS makes them.
#include <filesystem>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

/// lavapipe without something, and passing for hardware, so that auto would take it.
ProcessOptions lacking(const std::string& limits) {
  ProcessOptions options = kOnLavapipe;
  options.environment["MOTE_LIMITS"] = "deviceType=discrete," + limits;
  return options;
}

class DeviceLimits : public testing::Test {
 protected:
  DeviceLimits() {
    writeBytes(folder_.file("scene.json"),
               R"({"particles": [{"generate": "ball", "count": 200}], "output": {"size": [16, 9]}})");
  }
  ProcessResult render(const std::string& where, const std::string& limits) const {
    return mote({"render", folder_.file("scene.json"), "--lighting", where, "--raster", where, "-o", picture_},
                lacking(limits));
  }
  TempFolder folder_;
  const std::string picture_ = folder_.file("p.exr");
};

TEST_F(DeviceLimits, WithoutARequiredFeatureAutoTakesTheCpuAndGpuRefuses) {
  const std::pair<const char*, const char*> cases[] = {
      {"geometryShader=0", "feature geometryShader"},
      {"shaderInt64=0", "feature shaderInt64"},
      {"bufferDeviceAddress=0", "feature bufferDeviceAddress"},
      {"synchronization2=0", "feature synchronization2"},
      {"VK_KHR_push_descriptor=0", "extension VK_KHR_push_descriptor"},
      {"maxPushConstantsSize=64", "limit maxPushConstantsSize: 128 needed, 64 there"},
      {"maxColorAttachments=1", "limit maxColorAttachments: 2 needed, 1 there"},
      {"timestampComputeAndGraphics=0", "limit timestampComputeAndGraphics"},
      {"subgroupOperations=1", "subgroup operations: ballot"},
      {"R32_SFLOAT=0", "blended colour attachments of format R32_SFLOAT"},
      {"apiVersion=1.2", "Vulkan version: 1.3 needed, 1.2.0 there"},
  };
  for (const auto& [limits, sentence] : cases) {
    const ProcessResult listed = mote({"devices"}, lacking(limits));
    EXPECT_EQ(listed.exitCode, 0) << listed.err;
    EXPECT_TRUE(contains(listed.out, "cannot use it; it lacks:"));
    EXPECT_TRUE(contains(listed.out, sentence));
    const ProcessResult refused = render("gpu", limits);
    EXPECT_EQ(refused.exitCode, 3) << limits;
    EXPECT_TRUE(contains(refused.err, "lacks what Mote needs: "));
    EXPECT_TRUE(contains(refused.err, sentence));
    EXPECT_TRUE(contains(refused.err, "; use --lighting cpu --raster cpu\n"));
    EXPECT_FALSE(std::filesystem::exists(picture_));
    const ProcessResult host = render("auto", limits);
    EXPECT_EQ(host.exitCode, 0) << host.err;
    EXPECT_TRUE(contains(host.err, "lighting and picture on the CPU"));
    EXPECT_TRUE(contains(host.err, sentence));
    std::filesystem::remove(picture_);
  }
}

TEST_F(DeviceLimits, WhatIsOptionalIsDoneWithout) {
  const ProcessResult result = render("gpu", "shaderFloat64=0,largePoints=0,maxPointSize=1");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.err, "lighting on the GPU, picture on the GPU"));
}

TEST_F(DeviceLimits, WhatIsNoLimitIsBadInput) {
  for (const char* wrong :
       {"maxNothing=1", "geometryShader", "geometryShader=", "geometryShader=no", "deviceType=fast", "apiVersion=x"}) {
    const ProcessResult result = render("gpu", wrong);
    EXPECT_EQ(result.exitCode, 2) << wrong;
    EXPECT_TRUE(contains(result.err, "MOTE_LIMITS"));
  }
}

}  // namespace
}  // namespace mote::test
