// Choosing a device, memory beyond the usual limits, both ways of transfer, and that the layers really watch.
#include <algorithm>
#include <bit>
#include <cctype>
#include <cstdlib>

#include "engine/passes/depth_key_pass.h"
#include "engine/passes/sort_pass.h"
#include "engine/vulkan/check.h"
#include "host/core/error.h"
#include "host/core/random.h"
#include "shaders/glsl/layout/sort.h"
#include "shaders/glsl/layout/splat.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/leaks.h"

namespace mote {
namespace {

class DeviceTest : public GpuTest {};

template <class Failure>
std::string messageOf(auto&& action) {
  try {
    action();
  } catch (const Failure& failure) {
    return failure.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

void expectContains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "\"" << part << "\" is not in \"" << text << "\"";
}

TEST_F(DeviceTest, ReportSaysWhatADeviceIs) {
  const std::vector<DeviceReport> reports = listDevices();
  ASSERT_FALSE(reports.empty());
  const auto mine = std::find_if(reports.begin(), reports.end(),
                                 [&](const DeviceReport& report) { return report.name == device().name(); });
  ASSERT_NE(mine, reports.end());
  EXPECT_TRUE(mine->missing.empty()) << mine->missing.front();
  EXPECT_EQ(mine->apiVersion.substr(0, 2), "1.");
  EXPECT_FALSE(mine->driver.empty());
  EXPECT_EQ(mine->memory, device().memoryBytes());
  EXPECT_EQ(mine->type == "cpu", device().isCpu());
}

TEST_F(DeviceTest, MissingLimitsAreListedWithBothNumbers) {
  EXPECT_TRUE(missingLimits(device().limits(), device().mostSubgroupSize()).empty());
  VkPhysicalDeviceLimits limits = device().limits();
  limits.maxPushConstantsSize = 64;
  limits.timestampComputeAndGraphics = VK_FALSE;
  const std::vector<std::string> expected{"limit maxPushConstantsSize: 128 needed, 64 there",
                                          "limit timestampComputeAndGraphics"};
  EXPECT_EQ(missingLimits(limits, 64), expected);
}

TEST_F(DeviceTest, IsChosenByNumberOrPartOfItsName) {
  const Instance instance(false);
  const std::vector<DeviceReport> reports = listDevices(instance);
  const VkPhysicalDevice first = chooseDevice(instance, "0");
  std::string part = reports[0].name.substr(1, 5);
  std::transform(part.begin(), part.end(), part.begin(), [](unsigned char c) { return std::toupper(c); });
  EXPECT_EQ(chooseDevice(instance, part), first);
  if (reports.size() == 1) {
    EXPECT_EQ(chooseDevice(instance, ""), first);
  }
}

TEST_F(DeviceTest, UnknownDeviceIsInputErrorThatListsTheDevices) {
  const Instance instance(false);
  for (const std::string wanted : {"99", "no such device", "-1"}) {
    const std::string message = messageOf<InputError>([&] { chooseDevice(instance, wanted); });
    expectContains(message, "--device");
    expectContains(message, "\"" + wanted + "\"");
    expectContains(message, "0: " + listDevices(instance)[0].name);
  }
}

TEST_F(DeviceTest, NoDriverIsAMachineErrorThatSaysWhatToDo) {
  const char* const old = std::getenv("VK_ICD_FILENAMES");
  const std::string kept = old ? old : "";
  setenv("VK_ICD_FILENAMES", "/nonexistent/mote_no_driver.json", 1);
  const std::string message = messageOf<MachineError>([] { Gpu gpu(DeviceOptions{}); });
  if (old)
    setenv("VK_ICD_FILENAMES", kept.c_str(), 1);
  else
    unsetenv("VK_ICD_FILENAMES");
  EXPECT_EQ(message, "no Vulkan device; install mesa-vulkan-drivers or use --lighting cpu --raster cpu");
}

TEST_F(DeviceTest, FailureNamesCallResultAndNumbers) {
  EXPECT_NO_THROW(vkCheck(VK_SUCCESS, "vkQueueSubmit2"));
  EXPECT_EQ(messageOf<MachineError>([] { vkCheck(VK_ERROR_DEVICE_LOST, "vkQueueSubmit2", "17 dispatches"); }),
            "vkQueueSubmit2 failed: VK_ERROR_DEVICE_LOST (17 dispatches)");
  EXPECT_EQ(messageOf<MachineError>([] { vkCheck(static_cast<VkResult>(-12345), "vkFoo"); }),
            "vkFoo failed: VkResult -12345");
}

TEST_F(DeviceTest, TooLargeABufferIsRefusedWithTheNumbers) {
  const std::uint64_t bytes = device().maxBufferBytes() + (1u << 20);
  const std::string message = messageOf<MachineError>([&] { device().createBuffer(bytes); });
  expectContains(message, std::to_string(bytes));
  expectContains(message, std::to_string(device().memoryBytes()));
  const std::string beyond = messageOf<MachineError>([&] { device().createBuffer(1ull << 62); });
  expectContains(beyond, std::to_string(1ull << 62));
  const std::string image = messageOf<MachineError>(
      [&] { device().createImage(device().limits().maxImageDimension2D + 1, 1, VK_FORMAT_R32_SFLOAT); });
  expectContains(image, std::to_string(device().limits().maxImageDimension2D));
}

TEST_F(DeviceTest, BufferOfNoBytesIsAnArrayOfNoElements) {
  const Buffer buffer = device().createBuffer(0);
  EXPECT_EQ(buffer.size(), 0u);
  EXPECT_NE(buffer.address(), 0u);
  EXPECT_TRUE(device().download<float>(buffer, 0).empty());
}

TEST_F(DeviceTest, ComputeReachesArraysBeyondMaxStorageBufferRange) {
  // 10 M particles of 32 bytes: 320 MB, where lavapipe's maxStorageBufferRange is 128 MiB; 156,250 workgroups, where
  // maxComputeWorkGroupCount is 65,535. Keys at camera (0, 0, 0) and scale 1 of (x, 0, 0) are those of x².
  const std::uint32_t count = 10'000'000;
  const auto x = [](std::uint32_t i) { return static_cast<float>(i % 4096); };  // x² is exact
  const Buffer particles = device().createBuffer(std::uint64_t{count} * sizeof(layout::SplatParticle));
  const std::uint32_t part = 1u << 18;
  std::vector<layout::SplatParticle> some(part);
  for (std::uint32_t done = 0; done < count; done += part) {
    const std::uint32_t n = std::min(part, count - done);
    for (std::uint32_t i = 0; i < n; ++i) some[i].position = {x(done + i), 0, 0};
    device().upload(particles, std::span<const layout::SplatParticle>(some.data(), n), done);
  }
  const Buffer pairs = device().createBuffer(SortPass::pairBytes(count));
  const DepthKeyPass keys(device());
  device().run([&](CommandBuffer& commands) { keys.record(commands, particles, count, vec3(0), 1, pairs); });
  const auto result = device().download<layout::SortPair>(pairs, count);
  std::uint32_t wrong = 0;
  for (std::uint32_t i = 0; i < count; ++i)
    wrong += result[i].index != i || result[i].key != ~std::bit_cast<std::uint32_t>(x(i) * x(i));
  EXPECT_EQ(wrong, 0u);
}

TEST_F(DeviceTest, ClearedTargetsComeBackAndAreKeptOnLoad) {
  const Image2D color = device().createImage(5, 3, VK_FORMAT_R32G32B32A32_SFLOAT);
  const Image2D depth = device().createImage(5, 3, VK_FORMAT_R32_SFLOAT);
  const Buffer colorBytes = device().createBuffer(5 * 3 * 16), depthBytes = device().createBuffer(5 * 3 * 4);
  const VkClearColorValue colorClear{{0.25f, -2, 1e-30f, 3e38f}}, depthClear{{7}};
  device().run([&](CommandBuffer& commands) {
    commands.beginRendering({{color, colorClear}, {depth, depthClear}});
    commands.endRendering();
    commands.copyToBuffer(color, colorBytes);
    commands.beginRendering({{color, VkClearColorValue{}, true}, {depth, VkClearColorValue{}, true}});
    commands.endRendering();
    commands.copyToBuffer(depth, depthBytes);
  });
  const std::vector<float> colors = device().download<float>(colorBytes, 60);
  for (std::size_t i = 0; i < colors.size(); ++i) EXPECT_EQ(colors[i], colorClear.float32[i % 4]) << "at " << i;
  EXPECT_EQ(device().download<float>(depthBytes, 15), std::vector<float>(15, 7));
}

TEST(StagedTransfer, GivesBackWhatItTookAcrossSeveralParts) {
  // As on a discrete GPU: device memory is not mapped, and 65 MiB need two staging parts of 64 MiB.
  std::shared_ptr<const MessageLog> log;
  {
    const Gpu gpu(DeviceOptions{.validate = true, .stageAlways = true});
    log = gpu.instance().messageLog();
    const Device& device = gpu.device();
    std::vector<std::uint32_t> data(65u << 18);
    for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint32_t>(hashBits(5, i));
    const Buffer buffer = device.createBuffer(data.size() * 4 + 40);
    EXPECT_FALSE(buffer.mapped());
    device.upload(buffer, std::span<const std::uint32_t>(data), 10);
    EXPECT_EQ(device.download<std::uint32_t>(buffer, data.size(), 10), data);
  }
  EXPECT_EQ(log->messages(), std::vector<std::string>{});
}

TEST(Validation, CollectsSynchronizationHazards) {
  const Gpu gpu(DeviceOptions{.validate = true});
  const Buffer buffer = gpu.device().createBuffer(256);
  gpu.device().run([&](CommandBuffer& commands) {
    commands.fill(buffer, 1);
    commands.fill(buffer, 2);  // no barrier between the two
  });
  ASSERT_FALSE(gpu.validationMessages().empty());
  expectContains(gpu.validationMessages()[0], "SYNC-HAZARD-WRITE-AFTER-WRITE");
}

TEST(Validation, CollectsWhatIsLeftAtTheEnd) {
  std::shared_ptr<const MessageLog> log;
  {
    const Gpu gpu(DeviceOptions{.validate = true});
    log = gpu.instance().messageLog();
    VkFenceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    VkFence leaked = VK_NULL_HANDLE;
    const test::LeakOnPurpose here;
    ASSERT_EQ(vkCreateFence(gpu.device().handle(), &info, nullptr, &leaked), VK_SUCCESS);
  }
  ASSERT_FALSE(log->messages().empty());
  expectContains(log->messages()[0], "VkFence");
}

TEST(Validation, OtherInstancesMayComeAndGo) {
  const Gpu gpu(DeviceOptions{.validate = true});
  listDevices();  // an instance without the layers, after which the first must still work and end well
  const Buffer buffer = gpu.device().createBuffer(64);
  gpu.device().run([&](CommandBuffer& commands) { commands.fill(buffer, 7); });
  EXPECT_EQ(gpu.device().download<std::uint32_t>(buffer, 16), std::vector<std::uint32_t>(16, 7));
  EXPECT_EQ(gpu.validationMessages(), std::vector<std::string>{});
}

}  // namespace
}  // namespace mote
