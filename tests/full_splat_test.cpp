// Full splats on the host: lens, shutter, orthographic and anamorphic cameras, colours, emission, sprites, surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/splat/full_footprint.h"
#include "host/splat/rasterize_full.h"
#include "host/splat/splat.h"

namespace mote {
namespace {

using layout::SplatCamera;
using layout::SplatParticle;
using layout::uint;

constexpr uint kFalloffs[] = {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere};

SplatCamera cameraAtOrigin(int width, int height, uint falloff = layout::kFalloffSmooth) {
  return makeSplatCamera(vec3(0), vec3(0, 0, -1), vec3(0, 1, 0), 40, 0.01f, 1000, width, height, falloff);
}

/// A set of which nothing moves, seen by one camera.
SplatSet setOf(std::vector<SplatParticle> particles, const SplatCamera& camera) {
  SplatSet set;
  set.particles = std::move(particles);
  layout::SplatScene& s = set.scene;
  s.camera = s.open = s.close = s.before = s.after = camera;
  s.halfFrame = 0.5f / 24;
  return set;
}

std::vector<uint> identity(std::size_t count) {
  std::vector<uint> order(count);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

Image draw(const SplatSet& set, SplatLayers layers = {}, std::span<const float> surfaces = {}) {
  return rasterizeFull(set, identity(set.particles.size()), surfaces, layers);
}

/// Particles before the camera, `radius` pixels of support, well inside the picture.
std::vector<SplatParticle> scattered(const SplatCamera& camera, std::size_t count, double leastPixels,
                                     double mostPixels) {
  std::vector<SplatParticle> particles;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(3, i);
    const double depth = random.uniform(3, 6);
    const double u = random.uniform(-0.4, 0.4) * camera.halfExtent.x * 2,
                 v = random.uniform(-0.4, 0.4) * camera.halfExtent.y * 2;
    const double pixels = random.uniform(leastPixels, mostPixels);
    particles.push_back({vec3(u * depth, v * depth, -depth), static_cast<float>(pixels * camera.pixelSize * depth),
                         vec3(1, 0.5f, 0.25f), static_cast<float>(random.uniform(0.01, 2))});
  }
  return particles;
}

double sumOf(const std::vector<float>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

double oracleFalloff(double q, uint kind) {
  if (q >= 1) return 0;
  return kind == layout::kFalloffLinear   ? 1 - std::sqrt(q)
         : kind == layout::kFalloffSphere ? std::sqrt(1 - q)
                                          : (1 - q) * (1 - q);
}

TEST(FullSplat, EqualsThePlainRasteriserWhereNothingSpecialIsAsked) {
  for (const uint kind : kFalloffs) {
    const SplatCamera camera = cameraAtOrigin(200, 120, kind);
    const std::vector<SplatParticle> particles = scattered(camera, 2000, 0.3, 12);
    const SplatSet set = setOf(particles, camera);
    ASSERT_TRUE(set.plain());
    const Image plain = rasterize(particles, identity(2000), camera, true), full = draw(set, {.depth = true});
    EXPECT_EQ(plain.depth, full.depth);
    for (std::size_t i = 0; i < plain.pixels.size(); ++i)
      for (int c = 0; c < 4; ++c)
        ASSERT_NEAR(plain.pixels[i][c], full.pixels[i][c], kind == layout::kFalloffSphere ? 1e-5 : 2e-6)
            << "falloff " << kind;  // a sphere's rim is steep
  }
}

// Pixels are samples, so sums of small splats vary with where they fall; 200 particles average that.
TEST(FullSplat, LensAndShutterKeepTheSummedOpticalDepth) {
  double worst = 0;
  for (const uint kind : kFalloffs) {
    SplatSet sharp = setOf(scattered(cameraAtOrigin(640, 480, kind), 200, 4, 8), cameraAtOrigin(640, 480, kind));
    const double expected = sumOf(draw(sharp, {.opticalDepth = true}).opticalDepth);
    const auto holds = [&](const SplatSet& set, const char* what) {
      const double ratio = sumOf(draw(set, {.opticalDepth = true}).opticalDepth) / expected;
      EXPECT_NEAR(ratio, 1, 0.01) << what << ", falloff " << kind;
      worst = std::max(worst, std::fabs(ratio - 1));
    };
    SplatSet defocused = sharp;
    for (const float aperture : {0.003f, 0.01f, 0.05f}) {
      defocused.scene.camera.apertureRadius = aperture;
      defocused.scene.camera.focusDistance = 4.2f;
      holds(defocused, "depth of field");
    }
    SplatSet moving = sharp;
    moving.scene.moving = 1, moving.scene.openTime = -0.02f, moving.scene.closeTime = 0.02f;
    for (std::size_t i = 0; i < moving.particles.size(); ++i) {
      Random random(4, i);
      moving.velocity.push_back(vec3(random.uniform(-5, 5), random.uniform(-5, 5), 0));
    }
    holds(moving, "motion blur");
    moving.scene.camera.apertureRadius = 0.01f, moving.scene.camera.focusDistance = 4.2f;
    holds(moving, "both");
  }
  std::printf("summed optical depth with lens and shutter: off by at most %.2e\n", worst);
}

TEST(FullSplat, MotionBlurIsTheMeanOpticalDepthOverTheShutter) {
  for (const uint kind : kFalloffs) {
    const SplatCamera camera = cameraAtOrigin(160, 120, kind);
    const vec3 velocity(14, 6, 0);
    const SplatParticle particle{vec3(0.1f, -0.05f, -4), 9 * camera.pixelSize * 4, vec3(1), 0.8f};
    SplatSet set = setOf({particle}, camera);
    set.velocity = {velocity};
    set.scene.moving = 1, set.scene.openTime = -0.01f, set.scene.closeTime = 0.015f;
    const std::vector<float> blurred = draw(set, {.opticalDepth = true}).opticalDepth;
    constexpr int kMoments = 500;
    std::vector<double> mean(blurred.size(), 0);
    for (int k = 0; k < kMoments; ++k) {
      const float t = -0.01f + 0.025f * (static_cast<float>(k) + 0.5f) / kMoments;
      SplatParticle moved = particle;
      moved.position += velocity * t;
      const std::vector<float> still = draw(setOf({moved}, camera), {.opticalDepth = true}).opticalDepth;
      for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += still[i] / kMoments;
    }
    const double peak = *std::max_element(mean.begin(), mean.end());
    // Smooth is exact but for the pinhole's change of b along the path; the other falloffs have kinks.
    const double tolerance = kind == layout::kFalloffSmooth ? 0.002 : 0.02;
    for (std::size_t i = 0; i < mean.size(); ++i)
      ASSERT_NEAR(blurred[i], mean[i], tolerance * peak) << "falloff " << kind;
  }
}

TEST(FullSplat, AMovingCameraBlursAsMovingParticlesDo) {
  const SplatCamera camera = cameraAtOrigin(160, 120);
  const SplatParticle particle{vec3(0.1f, -0.05f, -4), 9 * camera.pixelSize * 4, vec3(1), 0.8f};
  SplatSet byParticle = setOf({particle}, camera);
  byParticle.velocity = {vec3(10, 0, 0)};
  byParticle.scene.moving = 1, byParticle.scene.openTime = -0.01f, byParticle.scene.closeTime = 0.01f;
  SplatSet byCamera = setOf({particle}, camera);
  byCamera.scene.moving = 1;
  byCamera.scene.open.position.x = 0.1f, byCamera.scene.close.position.x = -0.1f;
  const Image a = draw(byParticle), b = draw(byCamera);
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    ASSERT_NEAR(a.pixels[i].w, b.pixels[i].w, 1e-5);
    sum += a.pixels[i].w;
  }
  EXPECT_GT(sum, 10);
}

TEST(FullSplat, TheLensLeavesWhatIsInFocusAndWidensTheRestByTheCircleOfConfusion) {
  const SplatCamera camera = cameraAtOrigin(400, 300);
  SplatCamera lens = camera;
  lens.apertureRadius = 0.1f, lens.focusDistance = 4;
  const auto particleAt = [&](float depth) {
    return SplatParticle{vec3(0, 0, -depth), 5 * camera.pixelSize * depth, vec3(1), 0.5f};
  };
  const Image sharp = draw(setOf({particleAt(4)}, camera)), focused = draw(setOf({particleAt(4)}, lens));
  EXPECT_EQ(std::memcmp(sharp.pixels.data(), focused.pixels.data(), sharp.pixels.size() * sizeof(vec4)), 0);
  for (const float depth : {2.5f, 8.0f}) {
    const Image image = draw(setOf({particleAt(depth)}, lens));
    // aperture · |z − focus| / (focus · z) on the image plane, and the particle's own 5 pixels.
    const double radius = 5 + 0.1 * std::fabs(depth - 4) / (4 * depth) / camera.pixelSize;
    double reach = 0;
    for (int x = 200; x < 400; ++x)
      if (image.at(x, 149).w > 0) reach = x + 0.5 - 200;
    EXPECT_NEAR(reach, radius, 1) << depth;
    EXPECT_GT(radius, 8);
  }
}

TEST(FullSplat, EachColourHasItsOwnOpacity) {
  const SplatCamera camera = cameraAtOrigin(33, 33);
  const SplatParticle particle{vec3(0, 0, -4), 20 * camera.pixelSize * 4, vec3(2, 3, 4), 0.7f};
  SplatSet set = setOf({particle, particle}, camera);
  set.extinction = {vec3(0, 1, 3), vec3(2, 1, 0)};
  const Image image = draw(set, {.colorAlpha = true});
  const vec3 tau(0.7 * 2, 0.7 * 2, 0.7 * 3);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(image.alpha[16 * 33 + 16][c], 1 - std::exp(-tau[c]), 1e-6) << c;
    EXPECT_NEAR(image.at(16, 16)[c], (1 - std::exp(-tau[c])) * particle.radiance[c], 1e-5)
        << c;  // the same radiance twice
  }
  const vec3& alpha = image.alpha[16 * 33 + 16];
  EXPECT_FLOAT_EQ(image.at(16, 16).w, (alpha.x + alpha.y + alpha.z) / 3);
}

TEST(FullSplat, EmissionIsDimmedByTheParticleItselfAndByThoseBefore) {
  const SplatCamera camera = cameraAtOrigin(33, 33);
  const auto particle = [&](float peak) {
    return SplatParticle{vec3(0, 0, -4), 20 * camera.pixelSize * 4, vec3(0), peak};
  };
  SplatSet thin = setOf({particle(0)}, camera);
  thin.emission = {vec3(1, 2, 3)};
  EXPECT_NEAR(draw(thin).at(16, 16).z, 3, 1e-5);  // at the centre F = 1
  EXPECT_EQ(draw(thin).at(16, 16).w, 0);
  SplatSet two = setOf({particle(1.5f), particle(0.4f)}, camera);  // the second lies over the first
  two.emission = {vec3(1), vec3(0)};
  EXPECT_NEAR(draw(two).at(16, 16).x, (1 - std::exp(-1.5)) / 1.5 * std::exp(-0.4), 1e-5);
  // Away from the centre less is emitted: e·F·(1 − e^(−τF))/(τF).
  const double q = std::pow(8 / 20.0, 2), f = (1 - q) * (1 - q);
  EXPECT_NEAR(draw(two).at(24, 16).x, f * (1 - std::exp(-1.5 * f)) / (1.5 * f) * std::exp(-0.4 * f), 2e-3);
}

TEST(FullSplat, OrthographicAndAnamorphicCamerasFollowTheirDefinition) {
  for (const bool orthographic : {true, false})
    for (const float aspect : {1.0f, 2.0f, 0.5f})
      for (const uint kind : kFalloffs) {
        SplatCamera camera =
            makeSplatCamera(vec3(1, 2, 3), vec3(0.2f, 0.1f, -1), vec3(0.1f, 1, 0), 40, 0.01f, 1000, 96, 64, kind);
        if (orthographic) makeOrthographic(camera, 3);
        setPixelAspect(camera, aspect);
        const SplatParticle particle{vec3(0.5f, 0.9f, 0.4f), 0.5f, vec3(1), 0.9f};
        const Image image = draw(setOf({particle}, camera));
        std::size_t covered = 0;
        for (int y = 0; y < image.height; ++y)
          for (int x = 0; x < image.width; ++x) {
            const dvec3 beside = (x + 0.5 - 48) * double(camera.pixelSize) * double(aspect) * dvec3(camera.right) +
                                 (32 - (y + 0.5)) * double(camera.pixelSize) * dvec3(camera.up);
            const dvec3 origin = dvec3(camera.position) + (orthographic ? beside : dvec3(0));
            const dvec3 ray = glm::normalize(orthographic ? dvec3(camera.forward) : beside + dvec3(camera.forward));
            const double b = glm::length(glm::cross(dvec3(particle.position) - origin, ray));
            const double alpha = 1 - std::exp(-0.9 * oracleFalloff(b * b / 0.25, kind));
            ASSERT_NEAR(image.at(x, y).w, alpha, kind == layout::kFalloffSphere ? 2e-3 : 1e-5)
                << x << ' ' << y << " aspect " << aspect << " orthographic " << orthographic;
            covered += alpha > 0;
          }
        EXPECT_GT(covered, 100u);
      }
}

TEST(FullSplat, ASurfaceCutsWhatLiesBehindIt) {
  const SplatCamera camera = cameraAtOrigin(33, 33);
  const float radius = 20 * camera.pixelSize * 4;
  const SplatSet set = setOf({{vec3(0, 0, -4), radius, vec3(1), 1.2f}}, camera);
  const auto depthWith = [&](float surface) {
    const std::vector<float> surfaces(33 * 33, surface);
    return draw(set, {.opticalDepth = true}, surfaces).opticalDepth[16 * 33 + 16];
  };
  EXPECT_NEAR(depthWith(kNoDepth), 1.2f, 1e-6);
  EXPECT_NEAR(depthWith(6), 1.2f, 1e-6);
  EXPECT_NEAR(depthWith(4), 0.6f, 1e-5);
  EXPECT_EQ(depthWith(2), 0);
  EXPECT_NEAR(depthWith(4 + radius / 2), 1.2f * (0.5f + 0.75f / 2 - 0.25f / 8), 1e-5);
  EXPECT_EQ(depthWith(layout::kPixelLeftOut), 0);
}

TEST(FullSplat, SpritesLieUprightOverTheParticleAndFadeItsOpacity) {
  const SplatCamera camera = cameraAtOrigin(65, 65);
  SplatSet set = setOf({{vec3(0, 0, -4), 30 * camera.pixelSize * 4, vec3(1), 2.0f}}, camera);
  const Image plain = draw(set);
  set.spriteColor = {vec4(1, 0, 0, 1), vec4(0, 1, 0, 1), vec4(0, 0, 1, 1), vec4(0, 0, 0, 1)};
  set.scene.spriteColorWidth = set.scene.spriteColorHeight = 2;
  set.spriteOpacity = {1, 1, 0.25f, 0.25f};
  set.scene.spriteOpacityWidth = 1, set.scene.spriteOpacityHeight = 4;
  const Image image = draw(set);
  const vec4 upperLeft = image.at(15, 15), upperRight = image.at(49, 15), lowerLeft = image.at(15, 49);
  EXPECT_GT(upperLeft.x, 0);
  EXPECT_EQ(upperLeft.y, 0);
  EXPECT_EQ(upperLeft.z, 0);
  EXPECT_GT(upperRight.y, 0);
  EXPECT_EQ(upperRight.x, 0);
  EXPECT_GT(lowerLeft.z, 0);
  EXPECT_EQ(lowerLeft.x, 0);
  EXPECT_NEAR(upperLeft.w, plain.at(15, 15).w, 1e-6);
  EXPECT_NEAR(lowerLeft.w, 0.25f * plain.at(15, 49).w, 1e-6);
  EXPECT_NEAR(image.at(32, 32).x, 0.25f * image.at(32, 32).w, 1e-6);  // the middle is the mean of the four
}

TEST(FullSplat, VelocityIsThatOfParticleAndCameraInPixelsAFrame) {
  const SplatCamera camera = cameraAtOrigin(65, 65);
  SplatSet set = setOf({{vec3(0, 0, -4), 20 * camera.pixelSize * 4, vec3(1), 1.0f}}, camera);
  set.velocity = {vec3(0.6f, 1.2f, 0)};
  const double pixels = 1 / (24 * 4 * double(camera.pixelSize));  // of one unit a second, one frame
  vec2 velocity = draw(set, {.velocity = true}).velocity[32 * 65 + 32];
  EXPECT_NEAR(velocity.x, 0.6 * pixels, 1e-3);
  EXPECT_NEAR(velocity.y, 1.2 * pixels, 1e-3);  // upward
  EXPECT_EQ(draw(set, {.velocity = true}).velocity[0], vec2(0));
  set.velocity.clear();
  set.scene.before.position.x = -0.1f, set.scene.after.position.x = 0.1f;
  velocity = draw(set, {.velocity = true}).velocity[32 * 65 + 32];
  EXPECT_NEAR(velocity.x, -0.2 / (4 * double(camera.pixelSize)), 1e-3);
  EXPECT_NEAR(velocity.y, 0, 1e-3);
}

TEST(FullSplat, OrthographicDepthKeysSortByDepth) {
  SplatCamera camera = cameraAtOrigin(64, 64);
  makeOrthographic(camera, 4);
  // Farther from the camera as the crow flies, but nearer along the axis.
  const std::vector<SplatParticle> particles{
      {vec3(0, 0, -2), 0.1f, vec3(1), 1}, {vec3(3, 0, -1), 0.1f, vec3(1), 1}, {vec3(0, 0, 1), 0.1f, vec3(1), 1}};
  EXPECT_EQ(sortByDepth(particles, camera, 0.25f), (std::vector<uint>{0, 1, 2}));
  EXPECT_EQ(sortByDepth(particles, cameraAtOrigin(64, 64), 0.25f), (std::vector<uint>{1, 0, 2}));
}

TEST(FullSplat, IsTheSameForAnyNumberOfThreads) {
  const SplatCamera camera = cameraAtOrigin(300, 200);
  SplatSet set = setOf(scattered(camera, 3000, 0.5, 20), camera);
  set.scene.camera.apertureRadius = 0.02f, set.scene.camera.focusDistance = 4;
  const auto once = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return draw(set, {.depth = true, .opticalDepth = true});
  };
  const Image one = once(1), seven = once(7);
  EXPECT_EQ(std::memcmp(one.pixels.data(), seven.pixels.data(), one.pixels.size() * sizeof(vec4)), 0);
  EXPECT_EQ(one.depth, seven.depth);
  EXPECT_EQ(one.opticalDepth, seven.opticalDepth);
}

/// What is not maybeSeen() leaves no trace in either rasteriser; and little else is kept.
TEST(FullSplat, WhatIsOutOfViewIsLeftOutAndNothingElse) {
  const SplatCamera pinhole = cameraAtOrigin(60, 40);
  SplatCamera lens = pinhole, parallel = pinhole, wide = pinhole;
  lens.apertureRadius = 0.2f, lens.focusDistance = 4;
  makeOrthographic(parallel, 4);
  setPixelAspect(wide, 2);
  SplatCamera turned = makeSplatCamera(vec3(0.3f, 0, 0), vec3(1, 0, -5), vec3(0, 1, 0), 40, 0.01f, 1000, 60, 40, 0);
  for (const SplatCamera& camera : {pinhole, lens, parallel, wide})
    for (const bool moving : {false, true}) {
      SCOPED_TRACE(::testing::Message() << camera.apertureRadius << ' ' << camera.orthographic << ' '
                                        << camera.pixelAspect << ' ' << moving);
      std::size_t kept = 0, drawn = 0;
      for (std::size_t i = 0; i < 3000; ++i) {
        Random random(11, i);
        const auto near = [&](double reach) { return static_cast<float>(random.uniform(-reach, reach)); };
        SplatSet set = setOf(
            {{vec3(near(4), near(4), near(8)), static_cast<float>(random.uniform(1e-3, 0.8)), vec3(1), 2}}, camera);
        if (moving) {
          set.velocity = {vec3(near(4), near(4), near(4))};
          set.scene.moving = 1, set.scene.openTime = -0.2f, set.scene.closeTime = 0.3f;
          if (i % 2 == 0 && camera.orthographic == 0) set.scene.close = turned;
        }
        const vec3 velocity = set.velocity.empty() ? vec3(0) : set.velocity[0];
        const bool seen = maybeSeen(set.particles[0], velocity, set.scene);
        const Image full = draw(set, {.depth = true});
        double alpha = 0;
        for (const vec4& pixel : full.pixels) alpha += pixel.w;
        if (set.plain())
          for (const vec4& pixel : rasterize(set.particles, identity(1), camera, true).pixels) alpha += pixel.w;
        ASSERT_TRUE(seen || alpha == 0) << i;
        kept += seen, drawn += alpha > 0;
      }
      EXPECT_GT(drawn, 200u);
      EXPECT_LT(kept, drawn + drawn / 5);
    }
}

}  // namespace
}  // namespace mote
