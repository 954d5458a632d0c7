// View and light agree: a camera at a distant light sees, as transmittance, what the lighting computed there (DESIGN
// §2).
#include <gtest/gtest.h>

#include <cmath>

#include "host/core/random.h"
#include "host/lighting/lighting.h"
#include "host/lighting/medium.h"
#include "host/splat/rasterize_full.h"
#include "host/splat/splat.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

class ViewEqualsLight : public ::testing::TestWithParam<layout::uint> {};

TEST_P(ViewEqualsLight, OnEveryPixelThatHasAProbeBehindTheCloud) {
  constexpr int kSize = 64;
  constexpr std::size_t kCount = 20000;
  const layout::uint falloff = GetParam();
  const vec3 eye(60, 80, 170);  // some 200 units off: rays are parallel to half a degree
  const double distance = glm::length(dvec3(eye));
  const float fov = static_cast<float>(2 * std::atan(1.1 / distance) * 180 / kPi);
  const layout::SplatCamera camera = makeSplatCamera(eye, {0, 0, 0}, {0, 1, 0}, fov, 1, 1000, kSize, kSize, falloff);

  std::vector<vec3> position;
  std::vector<float> radius, peak;
  for (std::size_t i = 0; i < kCount; ++i) {
    Random random(1, i);
    position.emplace_back(random.direction() * std::cbrt(random.uniform()));
    radius.push_back(static_cast<float>(random.uniform(0.08, 0.12)));  // > 2 pixels: no splat is stretched
    peak.push_back(static_cast<float>(random.uniform(0.005, 0.03)));
  }
  // One probe of no density on each pixel's ray, behind the cloud.
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const double u = (x + 0.5 - kSize / 2.0) * camera.pixelSize, v = (kSize / 2.0 - (y + 0.5)) * camera.pixelSize;
      const dvec3 direction = u * dvec3(camera.right) + v * dvec3(camera.up) + dvec3(camera.forward);
      position.emplace_back(dvec3(eye) + (distance + 2) * direction);
      radius.push_back(0.1f);
      peak.push_back(0);
    }
  const Octree tree = buildOctree(position, radius, peak);
  const layout::Light light = pointLight(eye);
  const std::vector<float> lit = transmittances(opticalDepths(tree, light, {falloff, layout::kEndpointSoft, 0}), light);

  std::vector<layout::SplatParticle> splats;
  for (std::size_t i = 0; i < position.size(); ++i) splats.push_back({position[i], radius[i], vec3(0), peak[i]});
  Bounds bounds;
  for (const vec3& p : position) bounds.add(p);
  const Image image = rasterize(splats, sortByDepth(splats, camera, depthKeyScale(bounds, eye)), camera, false);

  double worst = 0, least = 1;
  for (std::size_t slot = 0; slot < lit.size(); ++slot) {
    if (tree.source[slot] < kCount) continue;
    const double seen = 1 - double(image.pixels[tree.source[slot] - kCount].a);
    worst = std::max(worst, std::abs(seen - lit[slot]));
    least = std::min(least, double(lit[slot]));
  }
  std::printf("falloff %u: worst difference of transmittance %.2e\n", falloff, worst);
  EXPECT_LT(least, 0.3) << "the cloud is thick enough to tell";
  // At 200 units, float places a particle to 1.5e-5 of a unit in camera space: 2e-4 of a radius, so up to 4e-4 of one
  // particle's optical depth (0.03); some hundred overlap with random signs. For `sphere`, whose slope at the rim is
  // infinite, a grazing particle alone may be off by peak · √(2 · 2e-4) = 6e-4.
  EXPECT_LT(worst, falloff == layout::kFalloffSphere ? 6e-4 : 1e-4);
}

// Parallel rays both: no distance loses digits here.
TEST_P(ViewEqualsLight, OfADirectionalLightAndAnOrthographicCamera) {
  constexpr int kSize = 64;
  const layout::uint falloff = GetParam();
  const layout::Light light = directionalLight({0.3f, -0.8f, -0.5f});
  layout::SplatCamera camera =
      makeSplatCamera(-5.0f * light.direction, {0, 0, 0}, {0, 0, 1}, 40, 0.1f, 100, kSize, kSize, falloff);
  makeOrthographic(camera, 2.2f);

  std::vector<vec3> position;
  std::vector<float> radius, peak;
  SplatSet set;
  for (std::size_t i = 0; i < 20000; ++i) {
    Random random(1, i);
    position.emplace_back(random.direction() * std::cbrt(random.uniform()));
    radius.push_back(static_cast<float>(random.uniform(0.08, 0.12)));  // > 2 pixels: no splat is stretched
    peak.push_back(static_cast<float>(random.uniform(0.005, 0.03)));
    set.particles.push_back({position[i], radius[i], vec3(0), peak[i]});
  }
  // One receiver on each pixel's ray, behind the cloud.
  std::vector<float> x, y, z;
  const std::vector<std::uint32_t> selves(kSize * kSize, kNoSlot);
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column) {
      const double u = (column + 0.5 - kSize / 2.0) * camera.pixelSize,
                   v = (kSize / 2.0 - (row + 0.5)) * camera.pixelSize;
      const dvec3 point =
          dvec3(camera.position) + u * dvec3(camera.right) + v * dvec3(camera.up) + 7.0 * dvec3(camera.forward);
      x.push_back(static_cast<float>(point.x)), y.push_back(static_cast<float>(point.y)),
          z.push_back(static_cast<float>(point.z));
    }
  const Octree tree = buildOctree(position, radius, peak);
  const std::vector<float> lit = transmittances(
      opticalDepths(tree, {x, y, z, selves}, light, {falloff, layout::kEndpointSoft, 0}), x.size(), light, vec3(1));
  set.scene.camera = set.scene.open = set.scene.close = set.scene.before = set.scene.after = camera;
  const Image image = rasterizeFull(set, sortByDepth(set.particles, camera, 0.125f), {}, {});
  double worst = 0, least = 1;
  for (std::size_t pixel = 0; pixel < lit.size(); ++pixel) {
    worst = std::max(worst, std::abs(1 - double(image.pixels[pixel].a) - lit[pixel]));
    least = std::min(least, double(lit[pixel]));
  }
  std::printf("orthographic, falloff %u: worst difference of transmittance %.2e\n", falloff, worst);
  EXPECT_LT(least, 0.3) << "the cloud is thick enough to tell";
  EXPECT_LT(worst, falloff == layout::kFalloffSphere ? 1e-4 : 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Falloffs, ViewEqualsLight,
                         ::testing::Values(layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere));

}  // namespace
}  // namespace mote
