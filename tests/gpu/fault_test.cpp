// Devices that fail in the middle of a frame: what a renderer does then, with every kind of failure, at every place.
#include "engine/renderer.h"
#include "engine/vulkan/check.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/image/compare.h"
#include "host/scene/scene_reader.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/contains.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::contains;

TEST(FaultPlan, CountsEachKindOfCallForItself) {
  FaultPlan plan("lost@2,memory@1x2,refused-pipeline@1,memory-wait@3");
  EXPECT_EQ(plan.next(DeviceCall::Submit), VK_SUCCESS);
  EXPECT_EQ(plan.next(DeviceCall::Allocate), VK_ERROR_OUT_OF_DEVICE_MEMORY);
  EXPECT_EQ(plan.next(DeviceCall::Submit), VK_ERROR_DEVICE_LOST);
  EXPECT_EQ(plan.next(DeviceCall::Submit), VK_SUCCESS);
  EXPECT_EQ(plan.next(DeviceCall::Allocate), VK_ERROR_OUT_OF_DEVICE_MEMORY);
  EXPECT_EQ(plan.next(DeviceCall::Allocate), VK_SUCCESS);
  EXPECT_EQ(plan.next(DeviceCall::Pipeline), VK_ERROR_UNKNOWN);
  EXPECT_EQ(plan.next(DeviceCall::Open), VK_SUCCESS);
  EXPECT_EQ(plan.next(DeviceCall::Wait), VK_SUCCESS);
  for (const char* wrong : {"lost", "lost@", "lost@x", "gone@1", "lost-sort@1", "lost@1x", "lost@1;lost@2", "@1", " "})
    EXPECT_THROW(FaultPlan{wrong}, InputError) << wrong;
}

TEST(VkCheck, TellsWhatCanBeDoneAboutAFailure) {
  const auto faultOf = [](VkResult result) {
    try {
      vkCheck(result, "vkCall", "", 5);
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.bytes(), 5u);
      return error.fault();
    }
    throw std::logic_error("nothing was thrown");
  };
  EXPECT_EQ(faultOf(VK_ERROR_DEVICE_LOST), DeviceFault::Lost);
  EXPECT_EQ(faultOf(VK_ERROR_OUT_OF_DEVICE_MEMORY), DeviceFault::Memory);
  EXPECT_EQ(faultOf(VK_ERROR_MEMORY_MAP_FAILED), DeviceFault::Memory);
  EXPECT_EQ(faultOf(VK_ERROR_INITIALIZATION_FAILED), DeviceFault::Refused);
}

/// Everything that is done on a device in one frame: light of particles and of a wall, the full way to splat, a drawing
/// for each light.
constexpr const char* kScene = R"({
  "particles": [{"generate": "ball", "count": 6000}],
  "medium": {"optical_depth": 3},
  "lights": [{"name": "lamp", "type": "point", "position": [2, 2, 2], "intensity": 60},
             {"name": "sun", "type": "directional", "direction": [0.3, -1, -0.4], "irradiance": 3}],
  "lighting": {"cutoff": 0},
  "solids": [{"name": "wall", "file": "wall.obj"}],
  "camera": {"position": [1, 1.5, 4.5], "target": [0, 0, 0], "fov": 35, "near": 0.1, "far": 50},
  "output": {"size": [32, 24], "aovs": ["Z", "lights"]}
})";

constexpr Backends kGpu{true, true}, kAuto{true, true, true, true}, kCpu{false, false};

class Faults : public testing::Test {
 protected:
  Faults() {
    test::writeBytes(folder_.file("wall.obj"), "v -1 -1 0.3\nv 1 -1 0.2\nv 0 1 0.4\nf 1 2 3\n");
    test::writeBytes(folder_.file("scene.json"), kScene);
    scene_ = readScene(folder_.file("scene.json"));
    frame_ = prepareFrame(scene_, 1, prepared_);
    takeWarnings();
  }

  struct Result {
    Image image;
    FrameStats stats;
    std::vector<std::string> warnings;
  };
  Result render(Renderer& renderer) {
    Result result{{}, prepared_, {}};
    LitParticles lit = renderer.light(frame_, lightWanted(scene_), result.stats);
    result.image = renderer.draw(frame_, scene_, std::move(lit), result.stats);
    result.warnings = takeWarnings();
    return result;
  }
  /// On a device of its own, in which `faults` happen, and of which the layers must have nothing to say.
  Result render(Backends backends, const std::string& faults, int frames = 1) {
    Gpu gpu({.validate = true, .fill = kUnwritten, .faults = faults});
    const std::shared_ptr<const MessageLog> log = gpu.instance().messageLog();
    Result result;
    {
      Renderer renderer(backends, &gpu);
      for (int frame = 0; frame < frames; ++frame) result = render(renderer);
      after_ = renderer.backends();
    }
    if (gpu.isOpen()) {
      limit_ = gpu.device().budget().limit();
      EXPECT_EQ(gpu.device().budget().held(), 0u);
    }
    gpu.close();
    EXPECT_EQ(log->messages(), std::vector<std::string>{}) << faults;
    return result;
  }

  /// RESULT-CALL@N for each of the calls and ever greater N, until the frame has no call of that number; `check` gets
  /// what came of it, with the one warning that each is to cost.
  template <class Check>
  void everyFault(const std::string& result, std::initializer_list<const char*> calls, const Check& check) {
    for (const char* call : calls)
      for (int n = 1;; n += 1 + n) {
        const std::string faults = fmt::format("{}-{}@{}", result, call, n);
        SCOPED_TRACE(faults);
        const Result drawn = render(kGpu, faults);
        ASSERT_LT(n, 1000) << "the frame does not end";
        ASSERT_LE(drawn.warnings.size(), 1u);
        check(drawn);
        if (drawn.warnings.empty()) break;
      }
  }

  static void expectSame(const Image& a, const Image& b, const std::string& what) {
    EXPECT_TRUE(a.pixels == b.pixels) << what;
    EXPECT_TRUE(a.depth == b.depth) << what;
    ASSERT_EQ(a.layers.size(), b.layers.size()) << what;
    for (std::size_t k = 0; k < a.layers.size(); ++k) EXPECT_TRUE(a.layers[k].values == b.layers[k].values) << what;
  }

  test::TempFolder folder_;
  Scene scene_;
  FrameStats prepared_;
  Frame frame_;
  Backends after_;
  std::uint64_t limit_ = 0;
};

TEST_F(Faults, ALostDeviceIsOpenedAnewAndThePictureIsTheSame) {
  const Result whole = render(kGpu, "");
  EXPECT_EQ(whole.warnings, std::vector<std::string>{});
  EXPECT_EQ(whole.stats.lighting + whole.stats.raster, "gpugpu");
  int lighting = 0, solids = 0, picture = 0;
  everyFault("lost", {"submit", "allocate", "pipeline"}, [&](const Result& result) {
    expectSame(result.image, whole.image, "the picture");
    EXPECT_EQ(result.stats.lighting + result.stats.raster, "gpugpu");
    if (result.warnings.empty()) return;
    EXPECT_TRUE(contains(result.warnings[0], "frame 1: "));
    EXPECT_TRUE(contains(result.warnings[0], " failed: VK_ERROR_DEVICE_LOST"));
    EXPECT_TRUE(contains(result.warnings[0], "; repeated with the device opened anew, and that went well"));
    lighting += contains(result.warnings[0], "frame 1: lighting on ") ? 1 : 0;
    solids += contains(result.warnings[0], "frame 1: lighting of its solids on ") ? 1 : 0;
    picture += contains(result.warnings[0], "frame 1: picture on ") ? 1 : 0;
  });
  EXPECT_GT(lighting, 2);
  EXPECT_GT(solids, 0);
  EXPECT_GT(picture, 1);
}

TEST_F(Faults, ADeviceThatIsLostAgainIsLeftForTheCpuWhereThatIsAllowed) {
  const Result host = render(kCpu, "");
  const Result left = render(kAuto, "lost@2x1000");
  expectSame(left.image, host.image, "all of it on the CPU");
  ASSERT_EQ(left.warnings.size(), 1u);
  EXPECT_TRUE(contains(left.warnings[0],
                       "; repeated with the device opened anew, which failed in the same way; done on "
                       "the CPU, as all later frames are"));
  EXPECT_EQ(left.stats.lighting + left.stats.raster, "cpucpu");
  EXPECT_FALSE(after_.anyGpu());
  const Result later = render(kAuto, "lost@2x1000", 3);
  EXPECT_EQ(later.warnings, std::vector<std::string>{}) << "it was said once";
  expectSame(later.image, host.image, "a later frame");

  // It cannot even be opened again.
  const Result closed = render(kAuto, "lost@2,refused-open@2");
  ASSERT_EQ(closed.warnings.size(), 1u);
  EXPECT_TRUE(contains(closed.warnings[0], "anew, which failed: vkCreateDevice failed: VK_ERROR_UNKNOWN; done on"));
  expectSame(closed.image, host.image, "closed");
}

TEST_F(Faults, ADeviceThatWasAskedForIsAFailureOfTheFrameAndTheNextBeginsAnew) {
  Gpu gpu({.validate = true, .fill = kUnwritten, .faults = "lost@2x2"});
  Renderer renderer(kGpu, &gpu);
  try {
    render(renderer);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const MachineError& error) {
    for (const char* part : {"lighting on ", "VK_ERROR_DEVICE_LOST", "opened anew, which failed",
                             "--lighting auto and --raster auto go on on the CPU"})
      EXPECT_TRUE(contains(error.what(), part));
  }
  EXPECT_EQ(takeWarnings(), std::vector<std::string>{}) << "the error says it all";
  const Result next = render(renderer);
  EXPECT_EQ(next.warnings, std::vector<std::string>{});
  EXPECT_EQ(next.stats.lighting + next.stats.raster, "gpugpu");
  EXPECT_EQ(gpu.validationMessages(), std::vector<std::string>{});
}

TEST_F(Faults, MemoryThatRunsOutIsTriedWithInSmallerParts) {
  const Result whole = render(kGpu, "");
  const std::uint64_t limit = limit_;
  int lighting = 0, picture = 0;
  everyFault("memory", {"allocate", "wait"}, [&](const Result& result) {
    // Light by a tree in parts differs by rounding.
    EXPECT_LT(compareImages(result.image, whole.image).overall.max, 1e-4);
    if (result.warnings.empty()) return;
    EXPECT_TRUE(contains(result.warnings[0], "failed: VK_ERROR_OUT_OF_DEVICE_MEMORY"));
    EXPECT_TRUE(contains(result.warnings[0], "; repeated in parts that hold at most "));
    EXPECT_TRUE(contains(result.warnings[0], " bytes of its memory, and that went well"));
    const bool ofPicture = contains(result.warnings[0], "frame 1: picture");
    EXPECT_EQ(limit_ == Recovery::kLeastLimit, ofPicture) << "each step has a limit of its own";
    EXPECT_EQ(limit_ == limit, !ofPicture);
    lighting += contains(result.warnings[0], "frame 1: lighting") ? 1 : 0;
    picture += contains(result.warnings[0], "frame 1: picture") ? 1 : 0;
  });
  EXPECT_GT(lighting, 2);
  EXPECT_GT(picture, 0);
}

TEST_F(Faults, MemoryThatRunsOutAgainAndAgainIsLeftForTheCpuStepByStep) {
  const Result host = render(kCpu, "");
  const Result left = render(kAuto, "memory@1x1000");
  ASSERT_EQ(left.warnings.size(), 2u) << "light and picture";
  EXPECT_TRUE(contains(left.warnings[0], "frame 1: lighting on "));
  EXPECT_TRUE(contains(left.warnings[1], "frame 1: picture on "));
  for (const std::string& warning : left.warnings)
    EXPECT_TRUE(contains(warning, "; done on the CPU, as all later frames are"));
  expectSame(left.image, host.image, "all of it on the CPU");
  EXPECT_FALSE(after_.anyGpu());

  // Light alone may leave, the picture was asked for on the device.
  const Result light = render({true, true, true, false}, "refused-pipeline@1");
  EXPECT_EQ(light.stats.lighting + light.stats.raster, "cpugpu");
  EXPECT_THROW(render({true, true, true, false}, "memory@1x1000"), MachineError);
  takeWarnings();
}

TEST_F(Faults, WhatNoPartsCanHelpIsDoneOnTheCpuAtOnceWhereThatIsAllowed) {
  scene_.output.size = {20000, 1};  // wider than any device draws
  frame_ = prepareFrame(scene_, 1, prepared_);
  EXPECT_THROW(render(kGpu, ""), MachineError);
  takeWarnings();
  const Result result = render(kAuto, "");
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_TRUE(contains(result.warnings[0], "frame 1: picture on "));
  EXPECT_TRUE(contains(result.warnings[0], "; done on the CPU, as all later frames are"));
  EXPECT_EQ(result.stats.lighting + result.stats.raster, "gpucpu");
}

}  // namespace
}  // namespace mote
