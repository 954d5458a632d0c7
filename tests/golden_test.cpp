// Pictures of three small scenes against those that were looked at and committed: last and loosest.
//
// The golden files are float EXR written by `mote render tests/golden/X.json --lighting cpu --raster cpu`; see
// tests/golden/README.md for when to write them anew.
#include <cmath>

#include "engine/renderer.h"
#include "host/image/compare.h"
#include "host/image/exr.h"
#include "host/scene/scene_reader.h"
#include "tests/gpu/gpu_fixture.h"

namespace mote {
namespace {

class Golden : public GpuTest, public ::testing::WithParamInterface<const char*> {
 protected:
  void expectGolden(Backends backends) {
    const std::string base = std::string(MOTE_SOURCE_DIR) + "/tests/golden/" + GetParam();
    Scene scene = readScene(base + ".json");
    FrameStats stats;
    const Frame frame = prepareFrame(scene, scene.frames.first, stats);
    Renderer renderer(backends, &GpuEnvironment::instance().gpu());
    scene.output.depth = true;
    const Image image = renderer.draw(frame, scene, renderer.light(frame, {}, stats), stats);
    const ImageDifference difference = compareImages(image, readExr(base + ".exr"));
    // A different libm or compiler may move a particle of the generators by a rounding step; a wrong picture is off by
    // far more.
    EXPECT_GE(difference.within, 0.999);
    EXPECT_LE(difference.overall.rmse, 1e-3);
    std::printf("%s: RMSE %.2e, within 2/255: %.3f %%\n", GetParam(), difference.overall.rmse, 100 * difference.within);
  }
};

TEST_P(Golden, HostGivesTheCommittedPicture) { expectGolden({false, false}); }
TEST_P(Golden, DeviceGivesTheCommittedPicture) { expectGolden({true, true}); }

INSTANTIATE_TEST_SUITE_P(Scenes, Golden, ::testing::Values("ball", "cloud", "plume"));

}  // namespace
}  // namespace mote
