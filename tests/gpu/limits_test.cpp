// Devices that say they can do no more than Vulkan promises of every one: the picture is the same, or a sentence says
// why there is none.
#include "engine/renderer.h"
#include "engine/vulkan/check.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/image/compare.h"
#include "host/scene/scene_reader.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

/// Vulkan 1.3's table of required limits, as far as they are Mote's, and Vulkan's least subgroup in both directions.
const std::string kLeast =
    "maxImageDimension2D=4096,maxTexelBufferElements=65536,maxStorageBufferRange=134217728,maxPushConstantsSize=128,"
    "maxMemoryAllocationCount=4096,maxBoundDescriptorSets=4,maxPerStageDescriptorSampledImages=16,"
    "maxPerStageResources=128,maxDescriptorSetSampledImages=96,maxVertexOutputComponents=64,"
    "maxGeometryInputComponents=64,maxGeometryOutputComponents=64,maxGeometryOutputVertices=256,"
    "maxGeometryTotalOutputComponents=1024,maxFragmentInputComponents=64,maxFragmentOutputAttachments=4,"
    "maxFragmentDualSrcAttachments=1,maxFragmentCombinedOutputResources=4,maxComputeSharedMemorySize=16384,"
    "maxComputeWorkGroupCount=65535,maxComputeWorkGroupInvocations=128,maxComputeWorkGroupSize=128,"
    "maxFramebufferWidth=4096,maxFramebufferHeight=4096,maxViewportDimensions=4096,maxColorAttachments=4,"
    "maxBufferSize=1073741824,maxMemoryAllocationSize=1073741824,maxPushDescriptors=32,heap=1073741824";
const std::string kNoOptions = "shaderFloat64=0,largePoints=0,maxPointSize=1";

constexpr Backends kGpu{true, true};

struct Result {
  Image image;
  FrameStats stats;
};

class Limits : public testing::Test {
 protected:
  void setScene(const std::string& parts) {
    test::writeBytes(folder_.file("wall.obj"), "v -1 -1 0.3\nv 1 -1 0.2\nv 0 1 0.4\nf 1 2 3\n");
    test::writeBytes(folder_.file("scene.json"),
                     R"({"camera": {"position": [1, 1.5, 4.5], "target": [0, 0, 0], "fov": 35},
      "lights": [{"name": "lamp", "type": "point", "position": [2, 2, 2], "intensity": 60},
                 {"name": "sun", "type": "directional", "direction": [0.3, -1, -0.4], "irradiance": 3}], )" +
                         parts + "}");
    scene_ = readScene(folder_.file("scene.json"));
    prepared_ = {};
    frame_ = prepareFrame(scene_, 1, prepared_);
  }
  Result render(const std::string& limits) {
    const Gpu gpu({.validate = true, .fill = kUnwritten, .limits = limits});
    Gpu& own = const_cast<Gpu&>(gpu);
    Result result{{}, prepared_};
    Renderer renderer(kGpu, &own);
    LitParticles lit = renderer.light(frame_, lightWanted(scene_), result.stats);
    result.image = renderer.draw(frame_, scene_, std::move(lit), result.stats);
    EXPECT_EQ(gpu.validationMessages(), std::vector<std::string>{}) << limits;
    EXPECT_EQ(takeWarnings(), std::vector<std::string>{}) << limits;
    return result;
  }
  /// What may differ is the light of exact sums, whose order the lists' lengths decide.
  static void expectAlike(const Image& a, const Image& b, const std::string& what) {
    const ImageDifference difference = compareImages(a, b);
    EXPECT_LT(difference.overall.max, 1e-4) << what;
    for (const LayerDifference& layer : difference.layers)
      EXPECT_EQ(failuresOf(layer), std::vector<std::string>{}) << what;
  }

  test::TempFolder folder_;
  Scene scene_;
  FrameStats prepared_;
  Frame frame_;
};

TEST_F(Limits, ThatVulkanPromisesOfEveryDeviceGiveTheSamePicture) {
  setScene(
      R"("particles": [{"generate": "ball", "count": 5000}], "medium": {"optical_depth": 3, "extinction": [0.5, 1, 1.5]},
    "solids": [{"name": "wall", "file": "wall.obj"}], "output": {"size": [48, 32], "aovs": ["Z", "lights", "optical_depth"]})");
  const Image whole = render("").image;
  for (const std::string& limits :
       {kLeast, kLeast + "," + kNoOptions, kLeast + ",deviceType=discrete",
        kLeast + ",deviceType=integrated,minSubgroupSize=1,maxSubgroupSize=128," + kNoOptions})
    expectAlike(render(limits).image, whole, limits);
}

TEST_F(Limits, OfTexelBuffersCutTheLightGridWithTheSameBits) {
  setScene(R"("particles": [{"generate": "cloud", "count": 60000}], "medium": {"optical_depth": 3},
    "lighting": {"error": 0.02}, "output": {"size": [32, 24]})");
  const Result whole = render(""), cut = render("maxTexelBufferElements=65536");
  int grids = 0;
  for (const LightMethod& method : whole.stats.methods) grids += method.how.method == DepthMethod::Grid ? 1 : 0;
  EXPECT_GT(grids, 0) << "the test is of the grid";
  EXPECT_TRUE(cut.image.pixels == whole.image.pixels);
  EXPECT_TRUE(render("maxTexelBufferElements=16384").image.pixels == whole.image.pixels) << "a tile in parts";
  try {
    render("maxTexelBufferElements=256");  // less than Vulkan allows
    ADD_FAILURE() << "nothing was thrown";
  } catch (const MachineError& error) {
    EXPECT_NE(std::string(error.what()).find("maxTexelBufferElements"), std::string::npos) << error.what();
  }
}

TEST_F(Limits, OfPicturesAreNamedWithTheNumbers) {
  setScene(R"("particles": [{"generate": "ball", "count": 100}], "output": {"size": [4097, 8]})");
  try {
    render(kLeast);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const MachineError& error) {
    for (const char* part : {"4097 × 8", "at most 4096 × 4096", "a smaller picture or --raster cpu"})
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
  scene_.output.size = {4096, 8};
  frame_ = prepareFrame(scene_, 1, prepared_);
  render(kLeast);
}

TEST_F(Limits, WorkgroupsMustHoldEverySubgroup) {
  const Instance instance(false);
  const auto missing = [&](const std::string& limits) { return listDevices(instance, limits)[0].missing; };
  EXPECT_EQ(missing(kLeast + ",maxSubgroupSize=128"), std::vector<std::string>{});
  EXPECT_EQ(missing("maxSubgroupSize=128,maxComputeWorkGroupInvocations=64"),
            std::vector<std::string>{"limit maxComputeWorkGroupInvocations: 128 needed, 64 there"});
}

}  // namespace
}  // namespace mote
