// The splat camera, the footprint and the reference rasteriser against double-precision oracles and analytic sums.
#include "host/splat/splat.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/splat/footprint.h"
#include "host/splat/small_splats.h"

namespace mote {
namespace {

using layout::SplatCamera;
using layout::SplatParticle;
using layout::uint;

constexpr uint kFalloffs[] = {layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere};

/// DESIGN §2 in double, written without looking at footprint.h.
double falloffOracle(double q, uint kind) {
  switch (kind) {
    case layout::kFalloffLinear: return 1 - std::sqrt(q);
    case layout::kFalloffSphere: return std::sqrt(1 - q);
    default: return std::pow(1 - q, 2);
  }
}

SplatCamera cameraAtOrigin(int width, int height, float fov = 40, uint falloff = layout::kFalloffSmooth) {
  return makeSplatCamera(vec3(0), vec3(0, 0, -1), vec3(0, 1, 0), fov, 0.01f, 1000, width, height, falloff);
}

/// The particle with its image point at (px, py) [pixels], at a depth, with a support radius of `radius` pixels.
SplatParticle atPixel(const SplatCamera& c, double px, double py, double depth, double radius, float peak,
                      const vec3& radiance = vec3(1)) {
  const double u = (px - c.imageSize.x / 2.0) * c.pixelSize, v = (c.imageSize.y / 2.0 - py) * c.pixelSize;
  const dvec3 p = dvec3(c.position) + depth * (u * dvec3(c.right) + v * dvec3(c.up) + dvec3(c.forward));
  return {vec3(p), static_cast<float>(radius * c.pixelSize * depth), radiance, peak};
}

/// α of one particle at a point of the picture [pixels], in double: the distance of the centre from the line through
/// the camera along the ray, nothing where it is behind.
double alphaOracle(const SplatParticle& particle, const SplatCamera& c, double x, double y) {
  const dvec3 d = dvec3(particle.position) - dvec3(c.position);
  const double depth = glm::dot(d, dvec3(c.forward));
  if (depth < c.near || depth > c.far) return 0;
  const double r = particle.radius, effective = std::max(r, double(c.minRadius) * c.pixelSize * depth);
  const dvec3 ray = glm::normalize((x - c.imageSize.x / 2.0) * c.pixelSize * dvec3(c.right) +
                                   (c.imageSize.y / 2.0 - y) * c.pixelSize * dvec3(c.up) + dvec3(c.forward));
  if (glm::dot(d, ray) <= 0) return 0;
  const double b = glm::length(glm::cross(d, ray)), q = b * b / (effective * effective);
  return q < 1 ? r * r / (effective * effective) * -std::expm1(-particle.peak * falloffOracle(q, c.falloff)) : 0;
}

/// Error that float arithmetic may make at a pixel: the image point is off by a few roundings of its distance from the
/// picture's centre, d by a few of its length, which moves b by the same; α then moves with its slope. Two units of
/// 2⁻²⁴ of the whole width cover the roundings in a row (products and sums for d, a division, the pixel's offset); 1e-6
/// is the rounding of α itself: exponential and falloff. The sphere's slope is infinite at the rim, so it is measured
/// as the change over the shift itself rather than as a derivative.
double toleranceAt(const SplatParticle& p, const SplatCamera& c, double x, double y) {
  const dvec3 d = dvec3(p.position) - dvec3(c.position);
  const double depth = glm::dot(d, dvec3(c.forward)), widest = glm::length(d) / depth;
  const double largest = std::max(double(std::max(c.imageSize.x, c.imageSize.y)), widest / c.pixelSize);
  const double shift = 2 * 0x1p-24 * largest;  // [pixels]
  double lo = 1, hi = 0;
  for (const double dx : {-shift, 0.0, shift})
    for (const double dy : {-shift, 0.0, shift}) {
      const double a = alphaOracle(p, c, x + dx, y + dy);
      lo = std::min(lo, a), hi = std::max(hi, a);
    }
  return (hi - lo) + 1e-6;
}

/// Draws one particle and holds every pixel against the oracle; the worst |difference| / tolerance.
double worstAgainstOracle(const SplatParticle& particle, const SplatCamera& camera, double* worstAlpha = nullptr) {
  const std::vector<uint> order{0};
  const Image image = rasterize(std::span(&particle, 1), order, camera, false);
  double worst = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double alpha = alphaOracle(particle, camera, x + 0.5, y + 0.5);
      const vec4& got = image.at(x, y);
      const double tolerance = toleranceAt(particle, camera, x + 0.5, y + 0.5);
      for (int channel = 0; channel < 4; ++channel) {
        const double source = channel < 3 ? particle.radiance[channel] : 1;
        const double error = std::fabs(got[channel] - alpha * source) / std::max(1.0, source);
        if (worstAlpha) *worstAlpha = std::max(*worstAlpha, error);
        worst = std::max(worst, error / tolerance);
      }
    }
  return worst;
}

std::vector<SplatParticle> randomCloud(const SplatCamera& camera, std::size_t count, double maxRadius) {
  std::vector<SplatParticle> cloud;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(7, i);
    const double px = random.uniform(-20, camera.imageSize.x + 20), py = random.uniform(-20, camera.imageSize.y + 20);
    const vec3 radiance(random.uniform(), random.uniform(), random.uniform());
    const double depth = random.uniform(2, 9), radius = random.uniform(0.1, maxRadius);
    cloud.push_back(atPixel(camera, px, py, depth, radius, static_cast<float>(random.uniform(0.01, 2)), radiance));
  }
  return cloud;
}

std::vector<uint> identity(std::size_t count) {
  std::vector<uint> order(count);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

bool sameBytes(const Image& a, const Image& b) {
  return a.pixels.size() == b.pixels.size() && a.depth == b.depth &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(vec4)) == 0;
}

// ---- camera ----

TEST(SplatCamera, LooksAtTheTargetWithUpUpwardsAndRightToTheRight) {
  const SplatCamera c =
      makeSplatCamera({0, 1, 4}, {0, 1, 0}, {0, 1, 0}, 90, 0.1f, 50, 200, 100, layout::kFalloffLinear);
  EXPECT_LT(glm::length(c.right - vec3(1, 0, 0)), 1e-7f);
  EXPECT_LT(glm::length(c.up - vec3(0, 1, 0)), 1e-7f);
  EXPECT_LT(glm::length(c.forward - vec3(0, 0, -1)), 1e-7f);
  EXPECT_FLOAT_EQ(c.pixelSize, 0.02f);    // 2·tan 45° / 100
  EXPECT_FLOAT_EQ(c.halfExtent.x, 2.0f);  // twice as wide as high
  EXPECT_FLOAT_EQ(c.halfExtent.y, 1.0f);
  EXPECT_EQ(c.falloff, layout::kFalloffLinear);
  EXPECT_EQ(c.minRadius, kMinSplatRadius);
}

TEST(SplatCamera, AxesAreOrthonormalForAnObliqueView) {
  const SplatCamera c = makeSplatCamera({3, -2, 7}, {-1, 4, 0.5f}, {0.3f, 1, 0.2f}, 35, 0.1f, 50, 64, 64, 0);
  // A few float roundings of a unit vector.
  for (const vec3& axis : {c.right, c.up, c.forward}) EXPECT_NEAR(glm::length(dvec3(axis)), 1, 2e-7);
  EXPECT_NEAR(glm::dot(dvec3(c.right), dvec3(c.up)), 0, 2e-7);
  EXPECT_NEAR(glm::dot(dvec3(c.right), dvec3(c.forward)), 0, 2e-7);
  EXPECT_NEAR(glm::dot(dvec3(c.up), dvec3(c.forward)), 0, 2e-7);
  EXPECT_GT(glm::dot(c.up, vec3(0.3f, 1, 0.2f)), 0);
  EXPECT_NEAR(glm::dot(glm::cross(dvec3(c.right), dvec3(c.up)), -dvec3(c.forward)), 1, 4e-7);
}

TEST(SplatCamera, RejectsATargetAtThePositionAndUpAlongTheView) {
  EXPECT_THROW(makeSplatCamera({1, 1, 1}, {1, 1, 1}, {0, 1, 0}, 40, 0.1f, 9, 8, 8, 0), InputError);
  EXPECT_THROW(makeSplatCamera({0, 0, 0}, {0, 5, 0}, {0, -2, 0}, 40, 0.1f, 9, 8, 8, 0), InputError);
}

TEST(SplatCamera, MatricesPutPointsWhereTheRasteriserDoes) {
  const SplatCamera c = makeSplatCamera({3, -2, 7}, {-1, 4, 0.5f}, {0.3f, 1, 0.2f}, 35, 0.5f, 60, 160, 90, 0);
  const SplatParticle p = atPixel(c, 40, 72, 6, 3, 1);
  const vec4 inCamera = worldToCamera(c) * vec4(p.position, 1);
  // Positions of size 10 in float: 1e-6 each, over two matrices.
  EXPECT_NEAR(inCamera.z, 6, 1e-5);
  EXPECT_NEAR(inCamera.x / inCamera.z, (40 - 80) * c.pixelSize, 1e-6);
  EXPECT_NEAR(inCamera.y / inCamera.z, (45 - 72) * c.pixelSize, 1e-6);
  const vec4 ndc = worldToNdc(c) * vec4(p.position, 1);
  EXPECT_NEAR(ndc.x / ndc.w, 40.0 / 160, 1e-5);
  EXPECT_NEAR(ndc.y / ndc.w, 72.0 / 90, 1e-5);
  EXPECT_NEAR(ndc.w, 6, 1e-5);
  for (const auto& [depth, z] : {std::pair{c.near, 0.0f}, std::pair{c.far, 1.0f}}) {
    const vec4 end = worldToNdc(c) * vec4(c.position + depth * c.forward, 1);
    EXPECT_NEAR(end.z / end.w, z, 1e-5);
  }
}

// ---- footprint ----

TEST(Footprint, OneMinusExpKeepsItsDigitsFromTinyToHuge) {
  double worst = 0;
  for (double x = 1e-12; x < 200; x *= 1.0007) {
    const float value = static_cast<float>(x);
    const double exact = -std::expm1(-double(value));
    worst = std::max(worst, std::fabs(oneMinusExp(value) - exact) / exact);
  }
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(worst, 3e-7);  // what footprint.h promises
  EXPECT_EQ(oneMinusExp(0), 0.0f);
  EXPECT_EQ(oneMinusExp(1e30f), 1.0f);
}

TEST(Footprint, OutlineIsTheTangentsOfTheBall) {
  // A ball of radius 1 at (x, z): a ray u touches it where |x − u·z| = √(1 + u²).
  Random random(3);
  for (int i = 0; i < 10000; ++i) {
    const double z = std::exp(random.uniform(-4, 8)), x = z * std::tan(random.uniform(-1.5, 1.5));
    if (x * x + z * z < 1.01) continue;
    const vec2 interval = silhouette(static_cast<float>(x), static_cast<float>(z));
    for (const float u : {interval.x, interval.y}) {
      if (std::fabs(u) >= kUnbounded) continue;
      const double b = std::fabs(x - u * z) / std::sqrt(1 + double(u) * u);
      // b moves by |(x, z)| times the angle's rounding, itself a few 2⁻²⁴, more where the ball nearly touches the eye.
      const double distance = std::hypot(x, z);
      EXPECT_NEAR(b, 1, 1e-6 * distance / std::sqrt(1 - 1 / (distance * distance))) << x << ' ' << z << ' ' << u;
    }
    const double angle = std::atan2(x, z), half = std::asin(1 / std::hypot(x, z));
    if (std::fabs(angle + half - kPi / 2) > 1e-3) {
      EXPECT_EQ(interval.y >= kUnbounded, angle + half > kPi / 2) << x << ' ' << z;
    }
    if (std::fabs(angle - half + kPi / 2) > 1e-3) {
      EXPECT_EQ(interval.x <= -kUnbounded, angle - half < -kPi / 2) << x << ' ' << z;
    }
  }
}

TEST(Footprint, BoundsHoldEveryPixelThatTheOracleSees) {
  // Narrow and very wide lenses; particles all around, also with the camera inside them.
  for (const float fov : {5.0f, 40.0f, 120.0f, 170.0f}) {
    const SplatCamera camera = cameraAtOrigin(48, 32, fov);
    for (std::size_t i = 0; i < 3000; ++i) {
      Random random(11, i);
      const dvec3 direction = random.direction();
      const double distance = std::exp(random.uniform(-3, 3));
      const SplatParticle p{vec3(direction * distance), static_cast<float>(std::exp(random.uniform(-4, 2))), vec3(1),
                            1};
      Footprint f{};
      const bool seen = makeFootprint(p.position, p.radius, camera, f);
      for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 48; ++x) {
          // 1e-6 of α lies within float's rounding of the rim, where either answer is right.
          if (alphaOracle(p, camera, x + 0.5, y + 0.5) < 1e-6) continue;
          ASSERT_TRUE(seen && x + 0.5f >= f.lo.x && x + 0.5f <= f.hi.x && y + 0.5f >= f.lo.y && y + 0.5f <= f.hi.y)
              << "fov " << fov << " particle " << i << " pixel " << x << ' ' << y;
        }
    }
  }
}

// ---- one particle ----

TEST(SmallSplats, AreThoseBeforeTheFirstWideOne) {
  const SplatCamera camera =
      makeSplatCamera(vec3(0), vec3(0, 0, -1), vec3(0, 1, 0), 60, 0.01f, 1000, 320, 200, layout::kFalloffSmooth);
  std::vector<SplatParticle> particles;
  for (std::uint64_t i = 0; i < 40000; ++i) {
    Random random(5, i);
    const float z = static_cast<float>(random.uniform(0.2, 20));
    particles.push_back({vec3(z * random.uniform(-1.5, 1.5), z * random.uniform(-1.0, 1.0), -z),
                         static_cast<float>(0.01 * std::exp(random.uniform(0.0, 4.0))), vec3(1), 1});
  }
  const std::vector<layout::uint> order = sortByDepth(particles, camera, 1.0f / 32);
  for (const float side : {0.0f, 5.0f, 20.0f, 63.0f, 1000.0f}) {
    std::size_t expected = 0;
    for (; expected < order.size(); ++expected) {
      const SplatParticle& particle = particles[order[expected]];
      Footprint f;
      if (!makeFootprint(particle.position, particle.radius, camera, f)) continue;
      const vec2 size = glm::floor(f.hi + 0.5f) - glm::ceil(glm::max(f.lo - 0.5f, vec2(0)));
      if (std::max(size.x, size.y) > side) break;
    }
    EXPECT_EQ(smallSplatsFirst(particles, camera, 1.0f / 32, side), expected) << side;
  }
  EXPECT_EQ(smallSplatsFirst({}, camera, 1, 10), 0u);
}

TEST(Rasterize, OneParticleMatchesTheDoublePrecisionOracle) {
  double worst = 0, worstAlpha = 0;
  for (const uint kind : kFalloffs)
    for (std::size_t i = 0; i < 60; ++i) {
      Random random(5, i);
      const SplatCamera camera =
          makeSplatCamera({1, 2, 3}, {-2, 1, 0.5f}, {0.1f, 1, 0.3f}, static_cast<float>(random.uniform(10, 120)), 0.01f,
                          1000, 150, 90, kind);
      const SplatParticle p =
          atPixel(camera, random.uniform(-10, 160), random.uniform(-10, 100), std::exp(random.uniform(-2, 5)),
                  std::exp(random.uniform(-1, 4)), static_cast<float>(std::exp(random.uniform(-5, 2))), {1, 0.25, 3});
      worst = std::max(worst, worstAgainstOracle(p, camera, &worstAlpha));
    }
  RecordProperty("worstAlphaError", std::to_string(worstAlpha));
  RecordProperty("worstShareOfTolerance", std::to_string(worst));
  EXPECT_LT(worst, 1);
}

TEST(Rasterize, RowsStandFromTheTop) {
  const SplatCamera camera = cameraAtOrigin(40, 40);
  const std::vector<SplatParticle> particles{atPixel(camera, 10.5, 5.5, 3, 3, 2)};
  const Image image = rasterize(particles, identity(1), camera, false);
  float best = 0;
  ivec2 where(0);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x)
      if (image.at(x, y).w > best) best = image.at(x, y).w, where = {x, y};
  EXPECT_EQ(where, ivec2(10, 5));
  EXPECT_GT(glm::dot(particles[0].position, camera.up), 0);  // up in the scene is up in the picture
}

TEST(Rasterize, SplatAcrossTileBordersHasNoSeam) {
  // Tiles are 64 × 32: centres on, and a hair beside, corners and edges.
  const SplatCamera camera = cameraAtOrigin(200, 150);
  for (const double px : {63.5, 64.0, 64.001, 128.0, 100.0})
    for (const double py : {31.5, 32.0, 63.999, 96.0})
      for (const double radius : {0.3, 2.5, 9.0, 70.0})
        EXPECT_LT(worstAgainstOracle(atPixel(camera, px, py, 4, radius, 1), camera), 1)
            << px << ' ' << py << ' ' << radius;
}

TEST(Rasterize, PicturesNarrowerThanATileOrAVectorWork) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 50}, {17, 2}, {65, 33}}) {
    const SplatCamera camera = cameraAtOrigin(width, height);
    EXPECT_LT(worstAgainstOracle(atPixel(camera, width * 0.5, height * 0.5, 2, 4, 1), camera), 1) << width;
  }
}

TEST(Rasterize, ParticlesBehindNearerThanNearOrBeyondFarAreNotDrawn) {
  SplatCamera camera = cameraAtOrigin(32, 32);
  camera.near = 1, camera.far = 10;
  for (const float z : {5.0f, 0.5f, -0.99f, -10.01f}) {  // the camera looks along −z
    const std::vector<SplatParticle> particles{{vec3(0, 0, z), 0.5f, vec3(1), 1}};
    const Image image = rasterize(particles, identity(1), camera, true);
    for (const vec4& p : image.pixels) ASSERT_EQ(p, vec4(0)) << z;
    for (const float depth : image.depth) ASSERT_EQ(depth, kNoDepth) << z;
  }
  for (const float z : {-1.0f, -10.0f}) {
    const std::vector<SplatParticle> particles{{vec3(0, 0, z), 0.5f, vec3(1), 1}};
    EXPECT_GT(rasterize(particles, identity(1), camera, false).at(16, 16).w, 0.5f) << z;
  }
}

TEST(Rasterize, ParticlesOffScreenLeaveNothing) {
  const SplatCamera camera = cameraAtOrigin(32, 32);
  for (const auto& [x, y] : {std::pair{-5.0, 16.0}, {37.0, 16.0}, {16.0, -5.0}, {16.0, 37.0}}) {
    const std::vector<SplatParticle> particles{atPixel(camera, x, y, 3, 4, 5)};
    const Image image = rasterize(particles, identity(1), camera, false);
    for (const vec4& p : image.pixels) ASSERT_EQ(p, vec4(0)) << x << ' ' << y;
  }
}

TEST(Rasterize, ScreenFillingParticleAndCameraInsideTheSupportAreRight) {
  double worst = 0;
  for (const float fov : {40.0f, 100.0f, 160.0f})
    for (const uint kind : kFalloffs) {
      const SplatCamera camera = cameraAtOrigin(130, 70, fov, kind);
      for (const vec3& position : {vec3(0, 0, -2), vec3(0.3f, -0.2f, -0.5f), vec3(1.5f, 0.4f, -0.2f),
                                   vec3(-0.1f, 2, -0.1f), vec3(4, 3, -0.5f), vec3(0, 0, -0.02f)})
        for (const float radius : {1.0f, 2.5f, 30.0f}) {
          const double share = worstAgainstOracle({position, radius, vec3(1), 1}, camera);
          worst = std::max(worst, share);
          EXPECT_LT(share, 1) << fov << ' ' << kind << ' ' << position.x << ' ' << radius;
        }
    }
  RecordProperty("worstShareOfTolerance", std::to_string(worst));
}

// ---- sub-pixel particles ----

/// ∫ 1 − e^(−τ) over the unit disc / π, by the midpoint rule in q (b·db = ½·dq): 20,000 steps, error below 1e-6.
double meanOpacity(double peak, uint kind) {
  double sum = 0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) sum += -std::expm1(-peak * falloffOracle((i + 0.5) / kSteps, kind));
  return sum / kSteps;
}

/// Sums of the splat's pixels over its integral, less 1, for particles of `radius` pixels falling anywhere in a pixel.
struct SumError {
  double worst = 0, mean = 0;
};
SumError sumError(double radius, float minRadius, float peak, uint kind, int places) {
  constexpr double kDepth = 100;
  SplatCamera camera = cameraAtOrigin(16, 16, 0.5f, kind);  // a long lens: no obliqueness (cosine 1 − 1e-5)
  camera.minRadius = minRadius;
  const double integral = kPi * radius * radius * meanOpacity(peak, kind);
  SumError error;
  for (int i = 0; i < places; ++i) {
    // The R₂ sequence (Roberts 2018) fills the pixel evenly.
    const double x = std::fmod(0.5 + i * 0.7548776662466927, 1), y = std::fmod(0.5 + i * 0.5698402909980532, 1);
    const std::vector<SplatParticle> particles{atPixel(camera, 8 + x, 8 + y, kDepth, radius, peak)};
    const Image image = rasterize(particles, identity(1), camera, false);
    double sum = 0;
    for (const vec4& p : image.pixels) sum += p.w;
    error.worst = std::max(error.worst, std::fabs(sum / integral - 1));
    error.mean += (sum / integral - 1) / places;
  }
  return error;
}

TEST(Rasterize, SubPixelParticleKeepsItsTotalOpacity) {
  // The limits are the row of kMinSplatRadius in splat.h, rounded up: [falloff][τ 0.01, 1, 5].
  constexpr double kWorst[3][3] = {{0.016, 0.019, 0.048}, {0.020, 0.031, 0.094}, {0.13, 0.16, 0.24}};
  const float peaks[] = {0.01f, 1, 5};
  for (const uint kind : kFalloffs)
    for (int t = 0; t < 3; ++t)
      for (const double radius : {0.01, 0.3, 1.9}) {
        const SumError error = sumError(radius, kMinSplatRadius, peaks[t], kind, 400);
        EXPECT_LT(error.worst, kWorst[kind][t]) << kind << ' ' << peaks[t] << ' ' << radius;
        // 400 even places average sampling away: what is left is a twentieth or less of the worst.
        EXPECT_LT(std::fabs(error.mean), kWorst[kind][t] / 20 + 1e-4) << kind << ' ' << peaks[t] << ' ' << radius;
      }
}

TEST(Rasterize, SmallerMinimumRadiiSampleWorseThanTheOneChosen) {
  // Why kMinSplatRadius is 2 for the default falloff: 1.5 and less exceed 2 % at τ = 1.
  for (const float minRadius : {1.0f, 1.25f, 1.5f})
    EXPECT_GT(sumError(0.3, minRadius, 1, layout::kFalloffSmooth, 400).worst, 0.02) << minRadius;
  EXPECT_LT(sumError(0.3, kMinSplatRadius, 1, layout::kFalloffSmooth, 400).worst, 0.02);
}

TEST(Rasterize, TotalOpacityOfASubPixelParticleDoesNotDependOnTheResolution) {
  const vec3 position(0.013f, -0.007f, -8);
  double first = 0;
  for (const int size : {16, 64, 256, 1024}) {
    const SplatCamera camera = cameraAtOrigin(size, size, 5);
    // At most one pixel wide at 1024.
    const std::vector<SplatParticle> particles{{position, 0.0006f, vec3(1), 1}};
    const Image image = rasterize(particles, identity(1), camera, false);
    double sum = 0;
    for (const vec4& p : image.pixels) sum += p.w;
    const double total = sum * std::pow(camera.pixelSize * 8, 2);  // [scene units²]
    if (first == 0) first = total;
    EXPECT_NEAR(total / first, 1, 0.04) << size;  // two samplings of at most 2 % each
  }
}

// ---- many particles ----

TEST(Rasterize, BlendsOverInTheOrderGiven) {
  const SplatCamera camera = cameraAtOrigin(100, 60);
  const std::vector<SplatParticle> cloud = randomCloud(camera, 300, 25);
  std::vector<uint> order = identity(cloud.size());
  std::reverse(order.begin(), order.end());  // not by depth: the order alone decides
  const Image image = rasterize(cloud, order, camera, true);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      double colour[4] = {}, depth = kNoDepth, slack = 1e-6, unsure = 0;
      for (const uint i : order) {
        const double alpha = alphaOracle(cloud[i], camera, x + 0.5, y + 0.5);
        for (int c = 0; c < 4; ++c) colour[c] = colour[c] * (1 - alpha) + alpha * (c < 3 ? cloud[i].radiance[c] : 1.0f);
        // One splat's α may be off by its tolerance: so may the sum.
        if (alpha > 0) slack += toleranceAt(cloud[i], camera, x + 0.5, y + 0.5);
        if (alpha >= kDepthAlpha) depth = std::min(depth, -double(cloud[i].position.z));
        unsure += std::fabs(alpha - kDepthAlpha) < 1e-5;
      }
      for (int c = 0; c < 4; ++c) ASSERT_NEAR(image.at(x, y)[c], colour[c], slack) << x << ' ' << y;
      if (unsure == 0) {
        ASSERT_NEAR(image.depth[std::size_t(y) * image.width + x], depth, 1e-6 * depth) << x << ' ' << y;
      }
    }
}

TEST(Rasterize, OpaqueParticleDrawnLastHidesWhatIsBehind) {
  const SplatCamera camera = cameraAtOrigin(32, 32);
  const std::vector<SplatParticle> particles{atPixel(camera, 16.5, 16.5, 9, 6, 50, {1, 0, 0}),
                                             atPixel(camera, 16.5, 16.5, 3, 6, 50, {0, 0, 1})};
  const auto order = sortByDepth(particles, camera, 1);
  EXPECT_EQ(order, (std::vector<uint>{0, 1}));
  const Image image = rasterize(particles, order, camera, true);
  EXPECT_LT(glm::length(image.at(16, 16) - vec4(0, 0, 1, 1)), 1e-6f);
  EXPECT_NEAR(image.depth[16 * 32 + 16], 3, 1e-6);
}

TEST(Rasterize, ThinParticlesInThousandsAddUp) {
  // 20,000 particles of τ = 1e-6 in one place: 1 − e^(−0.02) at the pixel under them. 1 − exp() in float would be off
  // by up to 6 % each. Blending rounds 20,000 times by at most half of 2⁻³⁰ (the spacing below 0.02): 1e-5 of the sum.
  const SplatCamera camera = cameraAtOrigin(32, 32);
  const std::vector<SplatParticle> particles(20000, atPixel(camera, 16.5, 16.5, 5, 8, 1e-6f));
  const Image image = rasterize(particles, identity(particles.size()), camera, false);
  EXPECT_NEAR(image.at(16, 16).w / -std::expm1(-20000 * double(1e-6f)), 1, 1e-3);
}

TEST(Rasterize, DoesNotDependOnTheNumberOfThreads) {
  for (const uint kind : kFalloffs) {
    const SplatCamera camera = cameraAtOrigin(333, 222, 40, kind);
    const std::vector<SplatParticle> cloud = randomCloud(camera, 20000, 12);
    const auto draw = [&](unsigned threads) {
      const ThreadLimit limit(threads);
      return rasterize(cloud, sortByDepth(cloud, camera, 0.0625f), camera, true);
    };
    const Image one = draw(1), two = draw(2), three = draw(3);
    EXPECT_TRUE(sameBytes(one, two));
    EXPECT_TRUE(sameBytes(one, three));
    EXPECT_GT(one.at(150, 100).w, 0.5f);  // and it is not empty
  }
}

TEST(Rasterize, MatchesTheScalarTwinBitForBit) {
  // Whatever instruction set this CPU has: footprint.h's functions, one pixel at a time.
  for (const uint kind : kFalloffs) {
    const SplatCamera camera = cameraAtOrigin(90, 70, 60, kind);
    std::vector<SplatParticle> cloud = randomCloud(camera, 400, 20);
    cloud.push_back({vec3(0.4f, 0.1f, -0.2f), 1.5f, vec3(0.5f), 0.3f});  // the camera inside it
    const Image image = rasterize(cloud, identity(cloud.size()), camera, false);
    Image scalar(90, 70);
    for (const SplatParticle& p : cloud) {
      Footprint f;
      if (!makeFootprint(p.position, p.radius, camera, f)) continue;
      for (int y = 0; y < 70; ++y)
        for (int x = 0; x < 90; ++x) {
          const float q = footprintDistance(f.centre, f.image, f.pixel, vec2(x + 0.5f, y + 0.5f), camera.pixelSize);
          const float alpha = footprintAlpha(q, p.peak, f.opacity, kind);
          scalar.at(x, y) = scalar.at(x, y) * (1 - alpha) + alpha * vec4(p.radiance, 1);
        }
    }
    EXPECT_TRUE(sameBytes(image, scalar)) << kind;
  }
}

TEST(Rasterize, TellsAllSplatsAsDone) {
  const SplatCamera camera = cameraAtOrigin(333, 222);
  std::vector<SplatParticle> cloud = randomCloud(camera, 2000, 12);
  for (SplatParticle& particle : std::span(cloud).first(500)) particle.position = -particle.position;  // behind it
  for (const std::size_t count : {2000, 500}) {
    std::mutex mutex;
    double sum = 0;
    rasterize(cloud, identity(count), camera, true, [&](double splats) {
      const std::scoped_lock lock(mutex);
      EXPECT_GT(splats, 0);
      sum += splats;
    });
    EXPECT_NEAR(sum, static_cast<double>(count), 1e-6);  // rounding of some hundred additions
  }
}

TEST(Rasterize, EveryInstructionSetGivesTheSameBits) {
  const SplatCamera camera = cameraAtOrigin(150, 110, 60);
  const std::vector<SplatParticle> cloud = randomCloud(camera, 500, 20);
  const Image best = rasterize(cloud, identity(cloud.size()), camera, true);
  const auto supported = hwy::SupportedTargets();
  int tried = 0;
  for (auto rest = supported; rest != 0; rest &= rest - 1) {
    hwy::SetSupportedTargetsForTest(rest & -rest);
    hwy::GetChosenTarget().DeInit();  // the next call chooses anew
    EXPECT_TRUE(sameBytes(rasterize(cloud, identity(cloud.size()), camera, true), best))
        << hwy::TargetName(rest & -rest);
    ++tried;
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
  EXPECT_GE(tried, 2);  // every x86-64 has SSE2 or better, and the portable code
}

TEST(Rasterize, BatchesJoinWithoutATrace) {
  // More particles than one batch of 2¹⁸: the picture is that of two halves blended one after the other. Each pixel's
  // operations are the same, so the bits are.
  const SplatCamera camera = cameraAtOrigin(64, 32);
  const std::vector<SplatParticle> cloud = randomCloud(camera, 1000, 2);
  std::vector<uint> order;
  for (int i = 0; i < 300; ++i)
    for (uint k = 0; k < 1000; ++k) order.push_back((k * 7 + i) % 1000);
  const Image image = rasterize(cloud, order, camera, false);
  Image scalar(64, 32);
  std::vector<std::pair<Footprint, bool>> footprints(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i)
    footprints[i].second = makeFootprint(cloud[i].position, cloud[i].radius, camera, footprints[i].first);
  for (const int x : {5, 40})
    for (const uint i : order) {
      const Footprint& f = footprints[i].first;
      if (!footprints[i].second) continue;
      const float q = footprintDistance(f.centre, f.image, f.pixel, vec2(x + 0.5f, 16.5f), camera.pixelSize);
      const float alpha = footprintAlpha(q, cloud[i].peak, f.opacity, camera.falloff);
      scalar.at(x, 16) = scalar.at(x, 16) * (1 - alpha) + alpha * vec4(cloud[i].radiance, 1);
    }
  for (const int x : {5, 40}) EXPECT_EQ(image.at(x, 16), scalar.at(x, 16)) << x;
}

TEST(Rasterize, NoParticlesGiveAnEmptyPicture) {
  const Image image = rasterize({}, {}, cameraAtOrigin(7, 5), true);
  EXPECT_EQ(image.width, 7);
  EXPECT_EQ(image.height, 5);
  EXPECT_EQ(image.pixels, std::vector<vec4>(35, vec4(0)));
  EXPECT_EQ(image.depth, std::vector<float>(35, kNoDepth));
}

}  // namespace
}  // namespace mote
