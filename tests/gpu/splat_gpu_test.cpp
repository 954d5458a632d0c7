// The splat pass on the device against a double-precision oracle and against the host's rasteriser.
#include <array>
#include <cmath>
#include <numeric>

#include "engine/passes/splat_pass.h"
#include "host/core/error.h"
#include "host/core/random.h"
#include "host/splat/small_splats.h"
#include "host/splat/splat.h"
#include "tests/gpu/gpu_fixture.h"

namespace mote {
namespace {

using layout::SplatCamera;
using layout::SplatParticle;
using layout::uint;

constexpr std::array kFalloffs{layout::kFalloffSmooth, layout::kFalloffLinear, layout::kFalloffSphere};

/// An oblique view, so that no axis of the camera is one of the scene.
SplatCamera obliqueCamera(int width, int height, float fov, uint falloff) {
  return makeSplatCamera({1, 2, 3}, {-2, 1, 0.5f}, {0.1f, 1, 0.3f}, fov, 0.05f, 100, width, height, falloff);
}

/// The particle with its image point at (px, py) [pixels], at a depth, with a support radius of `radius` pixels.
SplatParticle atPixel(const SplatCamera& c, double px, double py, double depth, double radius, double peak,
                      const vec3& radiance = vec3(1)) {
  const double u = (px - c.imageSize.x / 2.0) * c.pixelSize, v = (c.imageSize.y / 2.0 - py) * c.pixelSize;
  const dvec3 p = dvec3(c.position) + depth * (u * dvec3(c.right) + v * dvec3(c.up) + dvec3(c.forward));
  return {vec3(p), static_cast<float>(radius * c.pixelSize * depth), radiance, static_cast<float>(peak)};
}

double falloffOracle(double q, uint kind) {
  if (kind == layout::kFalloffLinear) return 1 - std::sqrt(q);
  if (kind == layout::kFalloffSphere) return std::sqrt(1 - q);
  return (1 - q) * (1 - q);
}

/// α at the point (x, y) of the picture [pixels] from the text of DESIGN §2: distance of the centre from the ray.
double alphaOracle(const SplatParticle& p, const SplatCamera& c, double x, double y) {
  const dvec3 d = dvec3(p.position) - dvec3(c.position);
  const double depth = glm::dot(d, dvec3(c.forward));
  if (depth < c.near || depth > c.far) return 0;
  const double drawn = std::max<double>(p.radius, double(c.minRadius) * c.pixelSize * depth);
  const double u = (x - c.imageSize.x / 2.0) * c.pixelSize, v = (c.imageSize.y / 2.0 - y) * c.pixelSize;
  const dvec3 ray = glm::normalize(u * dvec3(c.right) + v * dvec3(c.up) + dvec3(c.forward));
  const dvec3 across = d - glm::dot(d, ray) * ray;
  const double q = glm::dot(across, across) / (drawn * drawn);
  if (q >= 1 || glm::dot(d, ray) <= 0) return 0;
  return p.radius * p.radius / (drawn * drawn) * -std::expm1(-p.peak * falloffOracle(q, c.falloff));
}

std::vector<uint> identity(std::size_t count) {
  std::vector<uint> order(count);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

/// All that can happen to a particle on its way to the picture, in turn.
std::vector<SplatParticle> everyKindOfParticle(const SplatCamera& c, std::size_t count) {
  std::vector<SplatParticle> cloud;
  for (std::size_t i = 0; i < count; ++i) {
    Random r(11, i);
    const double width = c.imageSize.x, height = c.imageSize.y;
    const vec3 radiance(r.uniform(), r.uniform(), r.uniform());
    const double px = r.uniform(0, width), py = r.uniform(0, height), peak = std::exp(r.uniform(-6, 1));
    const auto add = [&](double x, double y, double depth, double radius, double tau) {
      cloud.push_back(atPixel(c, x, y, depth, radius, tau, radiance));
    };
    const double depth = r.uniform(1, 20);
    switch (i % 8) {
      case 0: add(px, py, depth, r.uniform(1, 12), peak); break;
      case 1: add(px, py, depth, r.uniform(0, 1), peak); break;                       // sub-pixel
      case 2: add(px, py, -depth, -r.uniform(1, 50), peak); break;                    // behind, some reach the camera
      case 3: add(px + 2 * width, py - height, depth, r.uniform(1, 9), peak); break;  // off screen
      case 4: add(r.uniform(-20, 20), py, depth, r.uniform(1, 30), peak); break;      // across the border
      case 5: add(px, py, r.uniform(0.02, 0.08), r.uniform(1, 9), peak); break;       // on both sides of near (0.05)
      case 6: add(px, py, r.uniform(80, 120), r.uniform(1, 9), peak); break;          // on both sides of far (100)
      default:
        if (i % 64 == 7)  // few, or they hide the rest: screen-filling, or the camera inside the support
          add(px, py, r.uniform(0.1, 2), r.uniform(0.3, 2) * height, 0.02 * peak);
        else
          add(px, py, r.uniform(1, 2), r.uniform(20, 60), 0.1 * peak);
    }
  }
  return cloud;
}

struct Difference {
  double worst = 0, rmse = 0;
};

Difference difference(const Image& a, const Image& b) {
  Difference d;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      const double error = double(a.pixels[i][c]) - b.pixels[i][c];
      d.worst = std::max(d.worst, std::fabs(error));
      d.rmse += error * error;
    }
  d.rmse = std::sqrt(d.rmse / (4.0 * static_cast<double>(a.pixels.size())));
  return d;
}

class SplatPassTest : public GpuTest {
 protected:
  Image draw(const SplatPass& pass, std::span<const SplatParticle> particles, std::span<const uint> order,
             const SplatCamera& camera, std::uint32_t small = 0) {
    const SplatTarget target = pass.createTarget(static_cast<std::uint32_t>(camera.imageSize.x),
                                                 static_cast<std::uint32_t>(camera.imageSize.y));
    pass.draw(target, device().createBufferWith(particles), device().createBufferWith(order),
              static_cast<std::uint32_t>(order.size()), camera, nullptr, {}, false, small);
    return pass.download(target);
  }
  Image draw(std::span<const SplatParticle> particles, std::span<const uint> order, const SplatCamera& camera,
             bool withDepth = true) {
    return draw(SplatPass(device(), camera.falloff, withDepth), particles, order, camera);
  }

  /// Colour: a device may divide to within 2.5 units of the last place (Vulkan's floor; lavapipe rounds correctly), so
  /// q may be off by 3e-7. `smooth` and `linear` turn that into at most 1e-6 of α where the peak is below 3, and
  /// blending attenuates what lies behind: 1e-5 is room for ten such at one pixel. `sphere` rises as √(1 − q) at the
  /// rim, where 3e-7 becomes √3e-7 · peak = 2e-3, at few pixels: there the RMSE is what must stay small. Depth: equal,
  /// since lavapipe's division and square root are correctly rounded, so that α ≥ kDepthAlpha decides alike.
  void expectEqualsHost(std::span<const SplatParticle> particles, std::span<const uint> order,
                        const SplatCamera& camera) {
    const Image expected = rasterize(particles, order, camera, true);
    const Image got = draw(particles, order, camera);
    const Difference d = difference(got, expected);
    RecordProperty("worst" + std::to_string(camera.falloff), fmt::format("{:.3g}", d.worst));
    RecordProperty("rmse" + std::to_string(camera.falloff), fmt::format("{:.3g}", d.rmse));
    EXPECT_LE(d.worst, camera.falloff == layout::kFalloffSphere ? 2e-3 : 1e-5);
    EXPECT_LE(d.rmse, 1e-6);
    EXPECT_EQ(got.depth, expected.depth);
  }
};

TEST_F(SplatPassTest, OneParticleMatchesTheDoublePrecisionOracle) {
  // Directions and image points are float: each is off by a few 2⁻²⁴ of the focal length, here at most 120 pixels. Two
  // units, 1.4e-5 pixel, cover the roundings in a row; on a splat of at least 2 pixels' radius and peak ≤ 1 α changes
  // by at most 0.55 a pixel, so 1e-5 with the rounding of the exponential. Only the sphere is steeper, at its rim:
  // there the oracle itself says what the shift makes.
  constexpr double kShift = 2 * 0x1p-24 * 120, kTolerance = 1e-5;
  double worst = 0;
  for (const uint kind : kFalloffs) {
    const SplatPass pass(device(), kind, false);
    std::size_t covered = 0;
    for (std::size_t i = 0; i < 40; ++i) {
      Random r(5, i);
      const SplatCamera camera = obliqueCamera(96, 64, static_cast<float>(r.uniform(30, 60)), kind);
      const vec3 radiance(1, 0.25f, 0.5f);
      const SplatParticle particle = atPixel(camera, r.uniform(-5, 101), r.uniform(-5, 69), std::exp(r.uniform(-2, 4)),
                                             std::exp(r.uniform(-1, 4)), std::exp(r.uniform(-6, 0)), radiance);
      const Image image = draw(pass, std::span(&particle, 1), identity(1), camera);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          const double alpha = alphaOracle(particle, camera, x + 0.5, y + 0.5);
          covered += alpha > 0;
          double steep = 0;
          if (kind == layout::kFalloffSphere)
            for (const double dx : {-kShift, kShift})
              for (const double dy : {-kShift, kShift})
                steep = std::max(steep, std::fabs(alphaOracle(particle, camera, x + 0.5 + dx, y + 0.5 + dy) - alpha));
          for (int c = 0; c < 4; ++c) {
            const double error = std::fabs(image.at(x, y)[c] - alpha * (c < 3 ? radiance[c] : 1.0f));
            ASSERT_LE(error, kTolerance + steep) << "falloff " << kind << " particle " << i << " at " << x << ' ' << y;
            worst = std::max(worst, error - steep);
          }
        }
    }
    EXPECT_GT(covered, 40u * 100);  // the particles are not all off screen
  }
  RecordProperty("worst", fmt::format("{:.3g}", worst));
}

TEST_F(SplatPassTest, EveryKindOfParticleEqualsTheHostRasteriser) {
  for (const uint kind : kFalloffs) {
    SCOPED_TRACE(::testing::Message() << "falloff " << kind);
    const SplatCamera camera = obliqueCamera(641, 359, 50, kind);
    const std::vector<SplatParticle> cloud = everyKindOfParticle(camera, 8000);
    expectEqualsHost(cloud, sortByDepth(cloud, camera, 1.0f / 128), camera);
  }
}

TEST_F(SplatPassTest, SmallSplatsAreTheSameAsPoints) {
  const float side = SplatPass::smallSide(device());
  ASSERT_GE(side, 16);  // lavapipe has large points
  for (const uint kind : kFalloffs) {
    const SplatCamera camera = obliqueCamera(641, 359, 50, kind);
    const std::vector<SplatParticle> cloud = everyKindOfParticle(camera, 8000);
    const std::vector<uint> order = sortByDepth(cloud, camera, 1.0f / 128);
    const std::uint32_t small = smallSplatsFirst(cloud, camera, 1.0f / 128, side);
    EXPECT_GT(small, 0u);
    EXPECT_LT(small, cloud.size());
    const SplatPass pass(device(), kind, true, 1000);  // the change from points to quads is within a submission
    const Image quads = draw(pass, cloud, order, camera), both = draw(pass, cloud, order, camera, small);
    EXPECT_EQ(both.pixels, quads.pixels);
    EXPECT_EQ(both.depth, quads.depth);
  }
  // At the picture's edges and corners, with sides of even and odd length.
  const SplatCamera camera =
      makeSplatCamera(vec3(0), vec3(0, 0, -1), vec3(0, 1, 0), 60, 0.01f, 1000, 61, 40, layout::kFalloffSmooth);
  for (int i = 0; i < 200; ++i) {
    Random random(3, static_cast<std::uint64_t>(i));
    const SplatParticle particle{vec3(random.uniform(-1.2, 1.2), random.uniform(-0.8, 0.8), -1),
                                 static_cast<float>(random.uniform(0.01, 0.5)), vec3(0.5f, 1, 0.1f), 2};
    if (smallSplatsFirst(std::span(&particle, 1), camera, 1, side) == 0) continue;
    const SplatPass pass(device(), camera.falloff, true);
    const Image quad = draw(pass, std::span(&particle, 1), identity(1), camera),
                point = draw(pass, std::span(&particle, 1), identity(1), camera, 1);
    ASSERT_EQ(point.pixels, quad.pixels) << i;
    ASSERT_EQ(point.depth, quad.depth) << i;
  }
}

TEST_F(SplatPassTest, ScreenFillingParticleAndCameraInsideTheSupportEqualTheHost) {
  for (const float fov : {40.0f, 160.0f}) {
    const SplatCamera camera =
        makeSplatCamera(vec3(0), vec3(0, 0, -1), vec3(0, 1, 0), fov, 0.01f, 1000, 130, 70, layout::kFalloffSmooth);
    std::vector<SplatParticle> particles;
    for (const vec3& position : {vec3(0, 0, -2), vec3(1.5f, 0.4f, -0.2f), vec3(-0.1f, 2, -0.1f), vec3(4, 3, -0.5f)})
      for (const float radius : {1.0f, 2.5f, 30.0f}) particles.push_back({position, radius, vec3(0.5f, 1, 0.1f), 0.3f});
    for (std::size_t i = 0; i < particles.size(); ++i) {
      SCOPED_TRACE(::testing::Message() << "fov " << fov << " particle " << i);
      expectEqualsHost(std::span(particles).subspan(i, 1), identity(1), camera);
    }
  }
}

TEST_F(SplatPassTest, PicturesOfOnePixelAndOfTheGreatestWidthWork) {
  const auto widest = static_cast<int>(std::min(device().limits().maxImageDimension2D, 16384u));
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {3, 1}, {widest, 2}}) {
    SCOPED_TRACE(::testing::Message() << width << " x " << height);
    const SplatCamera camera = obliqueCamera(width, height, 0.1f, layout::kFalloffSmooth);
    std::vector<SplatParticle> particles;
    for (std::size_t i = 0; i < 200; ++i) {
      Random r(3, i);
      particles.push_back(
          atPixel(camera, r.uniform(0, width), r.uniform(0, height), r.uniform(1, 9), r.uniform(0.5, 20), 0.1));
    }
    // The last pixel, where vertex positions have the fewest digits left.
    particles.push_back(atPixel(camera, width - 0.5, height - 0.5, 2, 1, 1));
    const Image image = draw(particles, identity(particles.size()), camera);
    EXPECT_GT(image.at(width - 1, height - 1).w, 0.1f);
    expectEqualsHost(particles, identity(particles.size()), camera);
  }
}

TEST_F(SplatPassTest, PictureBeyondTheDeviceIsRefusedWithTheNumbers) {
  const SplatPass pass(device(), layout::kFalloffSmooth, true);
  const std::uint32_t most = device().limits().maxImageDimension2D;
  for (const auto& [width, height] : {std::pair{most + 1, 1u}, {1u, most + 1}}) try {
      pass.createTarget(width, height);
      ADD_FAILURE() << width << " x " << height << " was accepted";
    } catch (const MachineError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(fmt::format("{} × {}", width, height)), std::string::npos) << message;
      EXPECT_NE(message.find(fmt::format("{} × {}", most, most)), std::string::npos) << message;
    }
}

TEST_F(SplatPassTest, SubPixelParticlesKeepTheirTotalOpacity) {
  // 64 particles, one for each of 8 × 8 places in a pixel, far enough apart. Their mean is the integral by the midpoint
  // rule with steps of 1/8 pixel on a splat of 4 pixels: α is smooth, so it is right to far below 1e-3; the long lens
  // leaves an obliqueness of 1e-5. The integral of thin particles is peak · r² · ∫ F dA = peak · r² · π/3.
  constexpr double kPeak = 1e-3;  // 1 − e^−τ = τ to 5e-4
  for (const double radius : {0.01, 0.1, 0.7}) {
    const SplatCamera camera = obliqueCamera(64, 64, 0.5f, layout::kFalloffSmooth);
    std::vector<SplatParticle> particles;
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i)
        particles.push_back(atPixel(camera, 8 * i + 4 + i / 8.0, 8 * j + 4 + j / 8.0, 90, radius, kPeak));
    const Image image = draw(particles, identity(64), camera);
    double sum = 0;
    for (const vec4& p : image.pixels) sum += p.w;
    EXPECT_NEAR(sum / 64 / (kPeak * radius * radius * kPi / 3), 1, 2e-3) << radius;
  }
}

TEST_F(SplatPassTest, LaterParticlesCoverEarlierOnes) {
  const SplatCamera camera = obliqueCamera(32, 32, 40, layout::kFalloffSmooth);
  const std::vector<SplatParticle> particles{atPixel(camera, 16.5, 16.5, 3, 6, 1, {1, 0, 0}),
                                             atPixel(camera, 17.5, 16.5, 3, 6, 2, {0, 0, 1})};
  const double red = alphaOracle(particles[0], camera, 16.5, 16.5),
               blue = alphaOracle(particles[1], camera, 16.5, 16.5);
  const vec4 blueOver = draw(particles, identity(2), camera).at(16, 16);
  const vec4 redOver = draw(particles, std::vector<uint>{1, 0}, camera).at(16, 16);
  constexpr double kTolerance = 1e-5;  // as the first test: the focal length is 44 pixels, the peaks at most 2
  EXPECT_NEAR(blueOver.x, red * (1 - blue), kTolerance);
  EXPECT_NEAR(blueOver.z, blue, kTolerance);
  EXPECT_NEAR(redOver.x, red, kTolerance);
  EXPECT_NEAR(redOver.z, blue * (1 - red), kTolerance);
  for (const vec4& p : {blueOver, redOver}) EXPECT_NEAR(p.w, 1 - (1 - red) * (1 - blue), kTolerance);
}

TEST_F(SplatPassTest, DepthIsThatOfTheNearestParticleThatCounts) {
  const SplatCamera camera =
      makeSplatCamera(vec3(0), vec3(0, 0, -1), vec3(0, 1, 0), 40, 0.01f, 1000, 40, 40, layout::kFalloffSmooth);
  // Far, near, and one nearer still but thinner than kDepthAlpha.
  const std::vector<SplatParticle> particles{
      {vec3(0, 0, -8), 1, vec3(1), 1}, {vec3(0, 0, -4), 0.2f, vec3(1), 1}, {vec3(0, 0, -2), 0.5f, vec3(1), 5e-4f}};
  for (const std::vector<uint>& order : {std::vector<uint>{0, 1, 2}, {2, 1, 0}, {1, 2, 0}}) {
    const Image image = draw(particles, order, camera);
    EXPECT_EQ(image.depth[20 * 40 + 20], 4.0f);
    EXPECT_EQ(image.depth[20 * 40 + 24], 8.0f);  // 4.5 pixels off: outside the near one's 2.7, inside the far one's 6.9
    EXPECT_EQ(image.depth[0], kNoDepth);
  }
}

TEST_F(SplatPassTest, WithoutDepthLayerTheColourIsTheSame) {
  const SplatCamera camera = obliqueCamera(100, 60, 50, layout::kFalloffLinear);
  const std::vector<SplatParticle> cloud = everyKindOfParticle(camera, 800);
  const std::vector<uint> order = sortByDepth(cloud, camera, 1.0f / 128);
  const Image with = draw(cloud, order, camera, true), without = draw(cloud, order, camera, false);
  EXPECT_EQ(with.depth.size(), with.pixels.size());
  EXPECT_TRUE(without.depth.empty());
  EXPECT_EQ(with.pixels, without.pixels);
}

TEST_F(SplatPassTest, PartsJoinWithoutATraceAndReportTheirProgress) {
  const SplatCamera camera = obliqueCamera(100, 60, 50, layout::kFalloffSmooth);
  const std::vector<SplatParticle> cloud = everyKindOfParticle(camera, 2500);
  const std::vector<uint> order = sortByDepth(cloud, camera, 1.0f / 128);
  const Image whole = draw(cloud, order, camera);

  const SplatPass pass(device(), camera.falloff, true, 1000);
  EXPECT_EQ(pass.submissions(0), 1u);
  EXPECT_EQ(pass.submissions(1000), 1u);
  ASSERT_EQ(pass.submissions(2500), 3u);
  const SplatTarget target = pass.createTarget(100, 60);
  TimestampQueries times = device().createTimestampQueries(3);
  std::vector<std::uint32_t> drawn;
  pass.draw(target, device().createBufferWith(std::span(cloud)), device().createBufferWith(std::span(order)), 2500,
            camera, &times, [&](std::uint32_t points) { drawn.push_back(points); });
  EXPECT_EQ(drawn, (std::vector<std::uint32_t>{1000, 2000, 2500}));
  const Image parts = pass.download(target);
  EXPECT_EQ(parts.pixels, whole.pixels);
  EXPECT_EQ(parts.depth, whole.depth);
  ASSERT_EQ(times.results().size(), 1u);
  EXPECT_EQ(times.results()[0].stage, "splat");
  EXPECT_GT(times.results()[0].seconds, 0);
}

TEST_F(SplatPassTest, NoParticlesLeaveAClearedPicture) {
  const SplatCamera camera = obliqueCamera(20, 10, 50, layout::kFalloffSmooth);
  const SplatPass pass(device(), camera.falloff, true);
  const SplatTarget target = pass.createTarget(20, 10);
  const std::vector<SplatParticle> particles{atPixel(camera, 10, 5, 3, 20, 2)};
  const Buffer buffer = device().createBufferWith(std::span(particles));
  const Buffer order = device().createBufferWith(std::span<const uint>(identity(1)));
  pass.draw(target, buffer, order, 1, camera);
  EXPECT_GT(pass.download(target).at(10, 5).w, 0.5f);
  for (const auto& [points, indices] : {std::pair{&buffer, &order}, {&buffer, &buffer}}) {
    pass.draw(target, *points, *indices, 0, camera);
    const Image image = pass.download(target);
    for (const vec4& p : image.pixels) ASSERT_EQ(p, vec4(0));
    for (const float z : image.depth) ASSERT_EQ(z, kNoDepth);
  }
  const Buffer nothing = device().createBuffer(0);
  pass.draw(target, nothing, nothing, 0, camera);
  EXPECT_EQ(pass.download(target).at(10, 5), vec4(0));
}

TEST_F(SplatPassTest, RecordDrawsPartOfTheOrderOverWhatWasThere) {
  const SplatCamera camera = obliqueCamera(64, 48, 50, layout::kFalloffSmooth);
  const std::vector<SplatParticle> cloud = everyKindOfParticle(camera, 300);
  const std::vector<uint> order = sortByDepth(cloud, camera, 1.0f / 128);
  const SplatPass pass(device(), camera.falloff, true);
  const SplatTarget target = pass.createTarget(64, 48);
  const Buffer particles = device().createBufferWith(std::span(cloud));
  const Buffer indices = device().createBufferWith(std::span(order));
  device().run([&](CommandBuffer& commands) {
    pass.record(commands, target, particles, indices, 50, 100, camera, false);
    pass.record(commands, target, particles, indices, 150, 70, camera, true);
  });
  const Image got = pass.download(target), expected = rasterize(cloud, std::span(order).subspan(50, 170), camera, true);
  EXPECT_LE(difference(got, expected).worst, 1e-5);  // as expectEqualsHost
  EXPECT_EQ(got.depth, expected.depth);
}

TEST_F(SplatPassTest, ArraysBeyond128MiBAreReachedToTheirEnd) {
  // maxStorageBufferRange is 128 MiB on lavapipe; both arrays are longer, and what is drawn stands at their ends.
  constexpr std::uint32_t kParticles = (160u << 20) / sizeof(SplatParticle), kIndices = (160u << 20) / sizeof(uint);
  const SplatCamera camera = obliqueCamera(64, 48, 50, layout::kFalloffSmooth);
  const std::vector<SplatParticle> cloud = everyKindOfParticle(camera, 100);
  std::vector<uint> order = sortByDepth(cloud, camera, 1.0f / 128);
  const Image expected = rasterize(cloud, order, camera, true);

  const Buffer particles = device().createBuffer(std::uint64_t{kParticles} * sizeof(SplatParticle));
  device().upload(particles, std::span(cloud), kParticles - cloud.size());
  for (uint& index : order) index += kParticles - static_cast<uint>(cloud.size());
  const Buffer indices = device().createBuffer(std::uint64_t{kIndices} * sizeof(uint));
  device().upload(indices, std::span<const uint>(order), kIndices - order.size());
  const SplatPass pass(device(), camera.falloff, true);
  const SplatTarget target = pass.createTarget(64, 48);
  device().run([&](CommandBuffer& commands) {
    pass.record(commands, target, particles, indices, kIndices - 100, 100, camera, false);
  });
  const Image got = pass.download(target);
  EXPECT_LE(difference(got, expected).worst, 1e-5);  // as expectEqualsHost
  EXPECT_EQ(got.depth, expected.depth);
}

}  // namespace
}  // namespace mote
