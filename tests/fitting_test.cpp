// The fitted camera sees the whole box, the fitted light stands where it should.
#include "host/scene/fitting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/scene/scene_reader.h"

namespace mote {
namespace {

const std::string kLeast = R"({"particles":[{"file":"x.prt"}]})";

/// A scene of one particle file and these further keys of the root.
std::string with(const std::string& keys) { return R"({"particles":[{"file":"x.prt"}],)" + keys + "}"; }

/// Largest |x|/w or |y|/h of the box's corners in the picture (1 = at the edge); infinity where one is behind near.
double filled(const Scene& scene, const Bounds& box) {
  const Camera& camera = scene.camera;
  const dvec3 view = glm::normalize(dvec3(camera.target) - dvec3(camera.position));
  const dvec3 right = glm::normalize(glm::cross(view, dvec3(camera.up))), up = glm::cross(right, view);
  const bool perspective = camera.projection == Projection::Perspective;
  const double halfY = perspective ? std::tan(static_cast<double>(camera.fov) * kPi / 360) : 0.5 * camera.height;
  const double halfX =
      halfY * static_cast<double>(scene.output.pixelAspect) * scene.output.size.x / scene.output.size.y;
  double most = 0;
  for (int i = 0; i < 8; ++i) {
    const dvec3 corner(i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z);
    const dvec3 from = corner - dvec3(camera.position);
    const double depth = glm::dot(from, view);
    if (depth < static_cast<double>(camera.near) || depth > static_cast<double>(camera.far))
      return std::numeric_limits<double>::infinity();
    const double scale = perspective ? depth : 1;
    most = std::max(
        {most, std::abs(glm::dot(from, right)) / (scale * halfX), std::abs(glm::dot(from, up)) / (scale * halfY)});
  }
  return most;
}

const Bounds kBoxes[] = {{{-1, -1, -1}, {1, 1, 1}},
                         {{0, 0, 0}, {1, 20, 1}},
                         {{-50, 0, -50}, {50, 0.1f, 50}},
                         {{1e3f, 2e3f, -3e3f}, {1e3f + 1, 2e3f + 2, -3e3f + 3}},
                         {{-1e-6f, 0, 0}, {1e-6f, 1e-6f, 1e-6f}},
                         {{-1e9f, 0, 0}, {1e9f, 1e8f, 1e9f}},
                         {{0, 0, -1}, {0, 0, 1}}};
const ivec2 kSizes[] = {{1280, 720}, {100, 1000}, {4000, 100}};
const vec3 kUps[] = {{0, 1, 0}, {0, 0, 1}, {1, 2, -0.5f}};

void expectSeen(const Scene& scene, const Bounds& box) {
  // 0.9 is the margin asked for; float positions far from the origin may take a share of it.
  EXPECT_LE(filled(scene, box), 0.91) << box.hi.x << " " << scene.output.size.x << " " << scene.camera.up.z;
  // "Slightly above", as the scene's up has it.
  const vec3 toCamera = glm::normalize(scene.camera.position - scene.camera.target);
  EXPECT_NEAR(glm::dot(toCamera, glm::normalize(scene.camera.up)), std::sin(15 * kPi / 180), 1e-3);
}

TEST(Fitting, SeesTheWholeBoxWithAMarginAtEveryShapeSizeAndUp) {
  for (const Bounds& box : kBoxes) {
    for (const ivec2 size : kSizes) {
      for (const vec3 up : kUps) {
        for (const float fov : {5.0f, 40.0f, 120.0f}) {
          Scene scene = parseScene(kLeast, "s.json");
          scene.output.size = size;
          scene.output.pixelAspect = fov == 5 ? 0.5f : 2;
          scene.camera.up = up;
          scene.camera.fov = fov;
          fitDefaults(scene, box);
          expectSeen(scene, box);
        }
      }
    }
  }
}

TEST(Fitting, SeesTheWholeBoxOrthographically) {
  for (const Bounds& box : kBoxes) {
    for (const ivec2 size : kSizes) {
      for (const vec3 up : kUps) {
        for (const float pixelAspect : {0.25f, 1.0f, 3.0f}) {
          Scene scene = parseScene(with(R"("camera": {"type": "orthographic"})"), "s.json");
          scene.output.size = size;
          scene.output.pixelAspect = pixelAspect;
          scene.camera.up = up;
          fitDefaults(scene, box);
          expectSeen(scene, box);
        }
      }
    }
  }
}

TEST(Fitting, FillsAnOrthographicPictureByHeightOrWidth) {
  const Bounds cube{vec3(-1), vec3(1)};
  for (const ivec2 size : {ivec2(4000, 100), ivec2(100, 1000)}) {
    for (const float pixelAspect : {0.5f, 2.0f}) {
      Scene scene = parseScene(with(R"("camera": {"type": "orthographic"})"), "s.json");
      scene.output.size = size;
      scene.output.pixelAspect = pixelAspect;
      fitDefaults(scene, cube);
      EXPECT_NEAR(filled(scene, cube), 0.9, 1e-5);  // positions are floats
      EXPECT_FALSE(scene.camera.fittedHeight);
    }
  }
}

TEST(Fitting, KeepsAnOrthographicHeightThatIsGiven) {
  Scene scene = parseScene(with(R"("camera": {"type": "orthographic", "height": 5})"), "s.json");
  fitDefaults(scene, {vec3(-1), vec3(1)});
  EXPECT_EQ(scene.camera.height, 5);
  EXPECT_NE(scene.camera.position, Camera{}.position);
}

TEST(Fitting, PlacesTheKeyLightByTheCameraOfTheFirstKey) {
  Scene scene = parseScene(with(R"("camera": {"keys": [{"frame": 3, "position": [9, 0, 0], "target": [0, 0, 0]},
      {"frame": 5, "position": [-9, 0, 0]}]})"),
                           "s.json");
  fitDefaults(scene, {vec3(-1), vec3(1)});
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_LT(scene.lights[0].position.x, -1);  // behind the box, which is seen from +x
  EXPECT_GT(scene.lights[0].position.z, 1);   // and to the left
  EXPECT_EQ(scene.camera.keys.size(), 2u);
}

TEST(Fitting, PlacesACameraWhoseKeysOnlyZoom) {
  Scene scene = parseScene(with(R"("camera": {"keys": [{"frame": 1, "fov": 10}, {"frame": 5, "fov": 60}]})"), "s.json");
  const Bounds cube{vec3(-1), vec3(1)};
  fitDefaults(scene, cube);
  EXPECT_NEAR(filled(scene, cube), 0.9, 1e-5);  // at the camera's own fov; positions are floats
  EXPECT_EQ(scene.camera.keys.size(), 2u);
}

TEST(Fitting, FillsThePictureWithACube) {
  Scene scene = parseScene(kLeast, "s.json");
  const Bounds cube{vec3(-1), vec3(1)};
  fitDefaults(scene, cube);
  EXPECT_NEAR(filled(scene, cube), 0.9, 1e-5);  // positions are floats
}

TEST(Fitting, PlacesTheKeyLightBehindAboveAndLeftAtUnitRadiance) {
  Scene scene = parseScene(kLeast, "s.json");
  const Bounds box{{1, 2, 3}, {3, 6, 4}};
  fitDefaults(scene, box);
  ASSERT_EQ(scene.lights.size(), 1u);
  const LightSource& key = scene.lights[0];
  EXPECT_EQ(key.name, "key");
  const vec3 offset = vec3(key.position) - box.centre();
  const vec3 view = glm::normalize(scene.camera.target - scene.camera.position);
  EXPECT_LT(glm::dot(offset, glm::cross(view, scene.camera.up)), 0);
  EXPECT_GT(offset.y, 0);
  EXPECT_GT(glm::dot(offset, view), 0);
  EXPECT_GT(glm::length(offset), glm::length(box.size()));  // outside
  // Phase function 1/4π times irradiance I/d², in single precision.
  EXPECT_NEAR(key.strength / glm::dot(offset, offset) / (4 * kPi), 1, 1e-5);
}

TEST(Fitting, LeavesWhatTheSceneGives) {
  const std::string text = with(R"("lights":[{}], "camera":{"position":[0,0,9],"near":1,"far":20})");
  Scene scene = parseScene(text, "s.json");
  fitDefaults(scene, {vec3(-1), vec3(1)});
  EXPECT_EQ(scene, parseScene(text, "s.json"));
  Scene depths = parseScene(with(R"("camera":{"near":0.5})"), "s.json");
  fitDefaults(depths, {vec3(-1), vec3(1)});
  EXPECT_EQ(depths.camera.near, 0.5f);
  EXPECT_NE(depths.camera.position, Camera{}.position);
}

TEST(Fitting, KeepsTheFirstFramesCameraAndLightOverASequence) {
  Scene scene = parseScene(kLeast, "s.json");
  fitDefaults(scene, {vec3(-1), vec3(1)});
  const Scene first = scene;
  fitDefaults(scene, {vec3(-5), vec3(9)});
  EXPECT_EQ(scene, first);
}

TEST(Fitting, HandlesASinglePointAnywhere) {
  for (const vec3 point : {vec3(0), vec3(1e6f, -1e6f, 3), vec3(1e-20f)}) {
    Scene scene = parseScene(kLeast, "s.json");
    fitDefaults(scene, {point, point});
    EXPECT_NE(scene.camera.position, scene.camera.target);
    EXPECT_TRUE(std::isfinite(scene.lights[0].strength));
    EXPECT_LT(scene.camera.near, scene.camera.far);
  }
}

}  // namespace
}  // namespace mote
