// The camera between its keys: through each, without a jolt, straight where they are straight, round where they are
// round; and refused where it sees nothing.
#include "host/scene/camera_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "host/core/error.h"

namespace mote {
namespace {

CameraKey positionAt(float frame, const vec3& position) { return {.frame = frame, .position = position}; }

/// Keys with uneven gaps and every property, each named by some of them only.
Camera unevenCamera() {
  Camera camera;
  camera.focusDistance = 3.0f;
  camera.keys = {{.frame = -3.5f, .position = vec3(1, 2, 3), .fov = 30.0f},
                 {.frame = 0, .target = vec3(0, 0.25f, 0), .focusDistance = 5.0f},
                 {.frame = 1, .position = vec3(4, 1, 3), .up = vec3(0, 1, 0.25f)},
                 {.frame = 9, .position = vec3(4, 3, -2), .target = vec3(1, 0, 0), .fov = 50.0f},
                 {.frame = 11.25f, .position = vec3(-1, 3, 4), .up = vec3(0.1f, 1, 0), .focusDistance = 4.0f},
                 {.frame = 12, .target = vec3(0, 0, 1), .fov = 35.0f}};
  return camera;
}

std::string errorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(CameraPath, PassesExactlyThroughEveryKey) {
  const Camera camera = unevenCamera();
  for (const CameraKey& key : camera.keys) {
    const Camera at = cameraAt(camera, static_cast<double>(key.frame));
    if (key.position) {
      EXPECT_EQ(at.position, *key.position) << key.frame;
    }
    if (key.target) {
      EXPECT_EQ(at.target, *key.target) << key.frame;
    }
    if (key.up) {
      EXPECT_EQ(at.up, *key.up) << key.frame;
    }
    if (key.fov) {
      EXPECT_EQ(at.fov, *key.fov) << key.frame;
    }
    if (key.focusDistance) {
      EXPECT_EQ(at.focusDistance, key.focusDistance) << key.frame;
    }
    EXPECT_TRUE(at.keys.empty());
  }
}

TEST(CameraPath, StandsStillOutsideItsKeysAndWithOneOrNone) {
  Camera camera = unevenCamera();
  const Camera first = cameraAt(camera, -3.5), last = cameraAt(camera, 12);
  EXPECT_EQ(cameraAt(camera, -1e6), first);
  EXPECT_EQ(cameraAt(camera, 1e6), last);
  // Positions end at 11.25, a key before the last.
  EXPECT_EQ(cameraAt(camera, 11.5).position, *camera.keys[4].position);
  camera.keys = {positionAt(4, vec3(7, 8, 9))};
  for (const double frame : {-2.0, 4.0, 4.5, 30.0}) EXPECT_EQ(cameraAt(camera, frame).position, dvec3(7, 8, 9));
  camera.keys.clear();
  EXPECT_EQ(cameraAt(camera, 17.5), camera);
}

TEST(CameraPath, LeavesWhatNoKeyNames) {
  Camera camera;
  camera.fov = 33;
  camera.near = 0.5f;
  camera.keys = {positionAt(1, vec3(7, 8, 9)), positionAt(5, vec3(1, 2, 3))};
  Camera expected = camera;
  expected.keys.clear();
  Camera at = cameraAt(camera, 2.75);
  EXPECT_NE(at.position, camera.position);
  at.position = camera.position;
  EXPECT_EQ(at, expected);
}

TEST(CameraPath, HasAContinuousVelocityAcrossEveryInnerKey) {
  const Camera camera = unevenCamera();
  // One-sided differences over h differ by (|a₋| + |a₊|) h/2 with the accelerations a, here 0.2 to 1.6 units/frame²: at
  // h = 2^-9 by 0.0023; and by the rounding of float positions below 8, 2^-22·2/h = 0.0003. The broken line through
  // these keys turns its velocity by 1.0 and 4.0.
  const double h = 0x1p-9, tolerance = 0.003;
  for (const double frame : {1.0, 9.0}) {
    const dvec3 before(cameraAt(camera, frame - h).position), at(cameraAt(camera, frame).position),
        after(cameraAt(camera, frame + h).position);
    EXPECT_LT(glm::length((after - at) / h - (at - before) / h), tolerance) << frame;
  }
}

TEST(CameraPath, MovesSteadilyAlongALineOfEqualSteps) {
  Camera camera;
  camera.keys = {positionAt(1, vec3(0, 1, 4)), positionAt(3, vec3(2, 2, 4)), positionAt(5, vec3(4, 3, 4)),
                 positionAt(7, vec3(6, 4, 4))};
  for (double frame = 1; frame <= 7; frame += 0.0625) {
    const double s = (frame - 1) / 6;
    const dvec3 expected(6 * s, 1 + 3 * s, 4);
    // Half a unit in the last place below 8, per component.
    EXPECT_LT(glm::length(dvec3(cameraAt(camera, frame).position) - expected), 4.2e-7) << frame;
  }
}

TEST(CameraPath, MovesSteadilyAlongALineOfUnevenFrames) {
  Camera camera;
  camera.keys = {positionAt(0, vec3(0, 1, 4)), positionAt(1, vec3(1, 1, 4)), positionAt(5, vec3(5, 1, 4)),
                 positionAt(6, vec3(6, 1, 4))};
  for (double frame = 0; frame <= 6; frame += 0.0625)
    EXPECT_NEAR(static_cast<double>(cameraAt(camera, frame).position.x), frame, 2.4e-7) << frame;  // float below 8
}

TEST(CameraPath, FallsAlongAParabolaWhateverTheFrames) {
  // What the tangents are made for: uniform acceleration comes back exactly, first and last piece included.
  const auto fall = [](double frame) { return 0.25 * frame * frame - frame; };
  Camera camera;
  for (const float frame : {0.0f, 1.0f, 4.0f, 4.5f, 6.0f})
    camera.keys.push_back(positionAt(frame, vec3(frame, fall(static_cast<double>(frame)), 4)));
  for (double frame = 0; frame <= 6; frame += 0.0625)
    EXPECT_NEAR(static_cast<double>(cameraAt(camera, frame).position.y), fall(frame), 1.2e-7)
        << frame;  // float below 4
}

TEST(CameraPath, StaysOnACircleOfTwelveKeys) {
  Camera camera;
  camera.target = vec3(0);
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * kPi * i / 11;  // the last key closes the circle
    camera.keys.push_back(
        positionAt(static_cast<float>(1 + 10 * i), vec3(5 * std::cos(angle), 1, 5 * std::sin(angle))));
  }
  double worst = 0, worstAtEnds = 0;
  for (double frame = 1; frame <= 111; frame += 0.125) {
    const dvec3 p(cameraAt(camera, frame).position);
    const double off = std::abs(std::hypot(p.x, p.z) / 5 - 1);
    double& most = frame < 11 || frame > 101 ? worstAtEnds : worst;
    most = std::max(most, off);
    EXPECT_FLOAT_EQ(static_cast<float>(cameraAt(camera, frame).position.y), 1);
  }
  // Keys h = 2π/11 apart. The middle of an inner segment lies at cos(h/2) + (sin h / 4) sin(h/2) = 0.99757 of the
  // radius. The end segments are the parabola through three keys: across the circle its error is h⁴/32 = 0.0033 to
  // first order.
  EXPECT_LT(worst, 0.0025);
  EXPECT_LT(worstAtEnds, 0.0034);
}

TEST(CameraPath, RefusesWhatSeesNothing) {
  Camera camera;
  camera.target = vec3(0);
  camera.keys = {positionAt(0, vec3(-4, 0, 0)), positionAt(4, vec3(4, 0, 0))};
  EXPECT_NE(errorOf([&] { cameraAt(camera, 2); }).find("a target that is not the camera's position at frame 2"),
            std::string::npos);
  EXPECT_EQ(errorOf([&] { cameraAt(camera, 1.5); }), "");
  camera.keys = {positionAt(0, vec3(-4, 3, 0)), positionAt(4, vec3(4, 3, 0))};
  EXPECT_NE(errorOf([&] { cameraAt(camera, 2); }).find("not along the view direction at frame 2"), std::string::npos);
  camera.keys = {{.frame = 0, .up = vec3(0, 1, 0)}, {.frame = 1, .up = vec3(0, -1, 0)}};
  EXPECT_NE(errorOf([&] { cameraAt(camera, 0.5); }).find("a direction that is not zero at frame 0.5"),
            std::string::npos);
}

TEST(CameraPath, RefusesALensThatSwingsOutOfRange) {
  Camera camera;
  // A long fall to 1°, then rest: the curve goes on falling past the key.
  camera.keys = {{.frame = 0, .fov = 90.0f}, {.frame = 1, .fov = 1.0f}, {.frame = 2, .fov = 1.0f}};
  EXPECT_NE(errorOf([&] { cameraAt(camera, 1.25); }).find("a fov > 0 and < 180 at every frame, got -"),
            std::string::npos);
  camera.keys = {
      {.frame = 0, .focusDistance = 90.0f}, {.frame = 1, .focusDistance = 1.0f}, {.frame = 2, .focusDistance = 1.0f}};
  EXPECT_NE(errorOf([&] { cameraAt(camera, 1.25); }).find("a focus_distance > 0"), std::string::npos);
  camera.keys = {{.frame = 0, .height = 90.0f}, {.frame = 1, .height = 1.0f}, {.frame = 2, .height = 1.0f}};
  EXPECT_NE(errorOf([&] { cameraAt(camera, 1.25); }).find("a height > 0 at every frame"), std::string::npos);
}

TEST(CameraPath, IsSharpAtItsFocusDistanceElseAtTheTarget) {
  Camera camera;
  camera.position = vec3(1, 2, 3);
  camera.target = vec3(1, 5, 7);
  EXPECT_EQ(focusDistanceOf(camera), 5);
  camera.focusDistance = 2.0f;
  EXPECT_EQ(focusDistanceOf(camera), 2);
  camera.keys = {{.frame = 0, .focusDistance = 2.0f}, {.frame = 1, .focusDistance = 4.0f}};
  EXPECT_EQ(focusDistanceOf(cameraAt(camera, 0.5)), 3);
}

}  // namespace
}  // namespace mote
