// Shadow rays in the compute shader against the host's, flag by flag.
#include <algorithm>

#include "engine/passes/solid_pass.h"
#include "host/solids/mesh.h"
#include "host/solids/occlusion.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/lights.h"
#include "tests/support/solids.h"

namespace mote {
namespace {

class SolidPassTest : public GpuTest {
 protected:
  /// Flags that differ from the host's; all rays of the points toward the light.
  std::size_t differences(SolidPass& pass, const SolidTree& tree, const test::Points& points,
                          const layout::Light& light) {
    const std::vector<std::uint8_t> onDevice = pass.occluded(points.receivers(), {}, light);
    const std::vector<std::uint8_t> onHost = occluded(tree, points.receivers(), {}, light);
    EXPECT_EQ(onDevice.size(), onHost.size());
    lit_ = static_cast<std::size_t>(std::count(onDevice.begin(), onDevice.end(), 0));
    std::size_t count = 0;
    for (std::size_t k = 0; k < onHost.size(); ++k) count += onHost[k] != onDevice[k];
    return count;
  }
  std::size_t lit_ = 0;  // of the last call
};

Mesh spot() {
  Solid solid;
  solid.file = MOTE_SHARED_DATA "/mesh/spot.obj";
  return loadMesh(solid, 1);
}

TEST_F(SolidPassTest, NothingLeaksOutOfAClosedMesh) {
  std::size_t rays = 0;
  SolidPass pass(device());
  for (const Mesh& mesh : {test::boxMesh(8), test::ballMesh(12, {0.1f, 0.2f, -0.3f}, 1)}) {
    const SolidTree tree = buildSolidTree(test::trianglesOf(mesh));
    pass.setTree(tree);
    for (const vec3& eye : {vec3(0), vec3(0.31f, 0.017f, -0.43f)}) {
      const test::Points points = test::pointsBehind(mesh, eye, 250'000);
      rays += points.x.size();
      EXPECT_EQ(differences(pass, tree, points, pointLight(eye)), 0u);
      EXPECT_EQ(lit_, 0u);
    }
  }
  EXPECT_GE(rays, 1'000'000u);
}

TEST_F(SolidPassTest, DecidesAsTheHostDoesAtEveryEdgeAndEverywhereElse) {
  const Mesh mesh = spot();
  const SolidTree tree = buildSolidTree(test::trianglesOf(mesh));
  SolidPass pass(device());
  pass.setTree(tree);
  // From outside, aimed at edges and corners: silhouettes are where a last bit would show.
  for (const vec3& eye : {vec3(1.5f, 2, 1), vec3(0, 0.1f, -3)}) {
    const test::Points points = test::pointsBehind(mesh, eye, 50'000);
    EXPECT_EQ(differences(pass, tree, points, pointLight(eye)), 0u);
    EXPECT_GT(lit_, 10'000u);
    EXPECT_LT(lit_, points.x.size());
  }
  const test::Points points = test::pointsBehind(mesh, {0, 0, 0.2f}, 20'000);
  for (const vec3& direction : {vec3(0, -1, 0), vec3(0.2f, -1, 0.4f), vec3(0, 0, 1)})
    EXPECT_EQ(differences(pass, tree, points, directionalLight(direction)), 0u);
  EXPECT_GT(pass.deviceSeconds(), 0);
  EXPECT_GT(device().budget().held(), tree.triangles.size() * 36);
}

TEST_F(SolidPassTest, AsksOnlyWhatIsWanted) {
  const SolidTree tree = buildSolidTree(test::trianglesOf(test::boxMesh()));
  SolidPass pass(device());
  test::Points points;
  for (int i = 0; i < 4; ++i) points.add({0, 0, 0});
  using Flags = std::vector<std::uint8_t>;
  pass.setTree(buildSolidTree({}));
  EXPECT_EQ(pass.occluded(points.receivers(), {}, pointLight({0, 5, 0})), Flags(4, 0));
  pass.setTree(tree);
  layout::Light light = pointLight({0, 5, 0});
  EXPECT_EQ(pass.occluded(points.receivers(), Flags{1, 0, 0, 1}, light), (Flags{1, 0, 0, 1}));
  EXPECT_EQ(pass.occluded(points.receivers(), Flags(4, 0), light), Flags(4, 0));
  light.castsShadows = 0;
  EXPECT_EQ(pass.occluded(points.receivers(), {}, light), Flags(4, 0));
}

TEST_F(SolidPassTest, SplitsMoreRaysThanOneSubmissionTakes) {
  const Mesh mesh = test::boxMesh(1);
  const SolidTree tree = buildSolidTree(test::trianglesOf(mesh));
  SolidPass pass(device());
  pass.setTree(tree);
  EXPECT_EQ(differences(pass, tree, test::pointsBehind(mesh, {0, 4, 0}, (1 << 20) + 1000), pointLight({0, 4, 0})), 0u);
  EXPECT_GT(lit_, 1000u);
}

}  // namespace
}  // namespace mote
