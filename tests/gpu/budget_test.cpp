// Devices that may hold little: what does not fit is sorted, drawn and lit in parts, with the same results.
#include <cmath>

#include "engine/passes/depth_order.h"
#include "engine/passes/light_grid_pass.h"
#include "engine/passes/light_pass.h"
#include "engine/passes/part_size.h"
#include "engine/rasterizer.h"
#include "host/core/error.h"
#include "host/core/random.h"
#include "host/lighting/medium.h"
#include "host/splat/splat.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/small_device.h"
#include "tests/support/lights.h"

namespace mote {
namespace {

using layout::SplatParticle;

constexpr int kWidth = 64, kHeight = 48;

layout::SplatCamera camera() {
  return makeSplatCamera({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 40, 0.05f, 100, kWidth, kHeight, layout::kFalloffSmooth);
}
constexpr float kKeyScale = 1.0f / 8;

/// A ball with light, every tenth at the place of the one before.
std::vector<SplatParticle> splats(std::size_t count) {
  std::vector<SplatParticle> particles;
  for (std::size_t i = 0; i < count; ++i) {
    Random r(17, i);
    const vec3 position(r.direction() * std::cbrt(r.uniform()));
    particles.push_back({.position = i % 10 == 1 ? particles.back().position : position,
                         .radius = static_cast<float>(r.uniform(0.01, 0.1)),
                         .radiance = vec3(r.uniform(), r.uniform(), r.uniform()),
                         .peak = static_cast<float>(r.uniform(0.001, 0.02))});
  }
  return particles;
}

/// Colours, emission, velocity, motion blur, lens and a sprite: everything that full splats have.
SplatSet everything(std::size_t count) {
  SplatSet set;
  set.particles = splats(count);
  for (std::size_t i = 0; i < count; ++i) {
    Random r(18, i);
    set.extinction.emplace_back(r.uniform(), r.uniform(), r.uniform());
    set.emission.push_back(i % 50 == 0 ? vec3(2, 0.6f, 0.1f) : vec3(0));
    set.velocity.emplace_back(r.uniform(-1, 1), r.uniform(-1, 1), 0);
  }
  set.spriteOpacity = {1, 0.5f, 0.5f, 0.2f};
  layout::SplatScene& scene = set.scene;
  scene.spriteOpacityWidth = scene.spriteOpacityHeight = 2;
  scene.camera = camera();
  scene.camera.apertureRadius = 0.05f, scene.camera.focusDistance = 4;
  scene.open = scene.close = scene.before = scene.after = scene.camera;
  scene.openTime = -0.02f, scene.closeTime = 0.02f, scene.halfFrame = 1.0f / 48, scene.moving = 1;
  return set;
}

SplatSet plainSet(std::size_t count) {
  SplatSet set;
  set.particles = splats(count);
  set.scene.camera = set.scene.open = set.scene.close = set.scene.before = set.scene.after = camera();
  return set;
}

void expectSame(const Image& got, const Image& expected) {
  EXPECT_TRUE(got.pixels == expected.pixels);
  EXPECT_TRUE(got.depth == expected.depth);
  EXPECT_TRUE(got.alpha == expected.alpha);
  EXPECT_TRUE(got.opticalDepth == expected.opticalDepth);
  EXPECT_TRUE(got.velocity == expected.velocity);
}

Octree ballTree(std::size_t count, bool colors) {
  std::vector<vec3> position;
  std::vector<float> radius, density, green, blue;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(21, i);
    position.emplace_back(random.direction() * std::cbrt(random.uniform()));
    radius.push_back(static_cast<float>(random.uniform(0.01, 0.03)));
    density.push_back(static_cast<float>(2 * 4.0 / 3.0 * kPi / static_cast<double>(count)));
    green.push_back(static_cast<float>(random.uniform(0, 2)));
    blue.push_back(static_cast<float>(random.uniform(0, 0.2)));
  }
  Octree tree = buildOctree(position, radius, peakOpticalDepths(density, radius, layout::kFalloffSmooth, true, 1));
  if (!colors) return tree;
  tree.peakGreen = tree.peakBlue = tree.peak;
  for (std::size_t slot = 0; slot < count; ++slot)
    tree.peakGreen[slot] *= green[tree.source[slot]], tree.peakBlue[slot] *= blue[tree.source[slot]];
  return tree;
}

class Budget : public GpuTest {
 protected:
  Image drawWhole(SplatSet set, std::span<const float> surfaces, SplatLayers layers) {
    FrameStats stats;
    return deviceRasterizer(device(), set, kKeyScale, stats)->draw(surfaces, layers);
  }
};

TEST_F(Budget, CountsEveryByteAndGivesItBack) {
  const SmallDevice small(1 << 20);
  const Device& device = small.device();
  EXPECT_EQ(device.budget().limit(), 1u << 20);
  {
    Buffer buffer = device.createBuffer(100000);
    EXPECT_EQ(device.budget().held(), device.bufferCost(100000));
    const Image2D image = device.createImage(kWidth, kHeight, VK_FORMAT_R32G32B32A32_SFLOAT);
    const std::uint64_t both =
        device.bufferCost(100000) + device.imageCost(kWidth, kHeight, VK_FORMAT_R32G32B32A32_SFLOAT);
    EXPECT_EQ(device.budget().held(), both);
    const Buffer moved = std::move(buffer);
    EXPECT_EQ(device.budget().held(), both);
    buffer = device.createBuffer(300000);
    EXPECT_EQ(device.budget().held(), both + device.bufferCost(300000));
    buffer = {};
    EXPECT_EQ(device.budget().held(), both);
    EXPECT_EQ(device.budget().peak(), both + device.bufferCost(300000));
  }
  device.restartPeak();
  EXPECT_EQ(device.budget().peak(), 0u);
  const Buffer all = device.createBuffer(1 << 20);  // to the last byte
  EXPECT_EQ(device.budget().room(), 0u);
}

TEST_F(Budget, IsNineTenthsOfTheHeapUnlessSomethingElseIsSaid) {
  EXPECT_EQ(device().budget().limit(), static_cast<std::uint64_t>(0.9 * static_cast<double>(device().memoryBytes())));
  const Gpu half(DeviceOptions{.memory = {.share = 0.5}}), more(DeviceOptions{.memory = {.bytes = 1ull << 50}});
  EXPECT_EQ(half.device().budget().limit(), half.device().memoryBytes() / 2);
  EXPECT_EQ(more.device().budget().limit(), more.device().memoryBytes());
}

TEST_F(Budget, RefusesWhatIsBeyondItWithTheNumbers) {
  const SmallDevice small(1 << 20);
  const Buffer taken = small.device().createBuffer(400000);
  const auto messageOf = [](const auto& action) -> std::string {
    try {
      action();
    } catch (const MachineError& error) {
      return error.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return "";
  };
  const std::string heap = std::to_string(small.device().memoryBytes());
  const std::string buffer = messageOf([&] { small.device().createBuffer(700000); });
  const std::string image = messageOf([&] { small.device().createImage(500, 500, VK_FORMAT_R32_SFLOAT); });
  const std::string part = messageOf([&] {
    partThatFits(
        small.device(), 5000, 1000, [](std::uint64_t count) { return std::vector<std::uint64_t>{count * 1000}; }, 0,
        "the things");
  });
  for (const std::string& message : {buffer, image, part})
    for (const std::string& number : {std::string("1048576"), heap, std::to_string(small.device().budget().held())})
      EXPECT_NE(message.find(number), std::string::npos) << number << " in " << message;
  EXPECT_NE(buffer.find(std::to_string(small.device().bufferCost(700000))), std::string::npos) << buffer;
  EXPECT_NE(part.find("the things"), std::string::npos) << part;
  EXPECT_NE(part.find("--device-memory"), std::string::npos) << part;
}

TEST_F(Budget, PartsAreAsLargeAsFits) {
  const SmallDevice small(1 << 20);
  const Device& device = small.device();
  const ArraySizes sizes = [](std::uint64_t count) { return std::vector<std::uint64_t>{count * 7, count * 40}; };
  EXPECT_EQ(partThatFits(device, 100, 10, sizes, 0, ""), 100u);
  EXPECT_EQ(partThatFits(device, 0, 10, sizes, 0, ""), 0u);
  for (const std::uint64_t reserved : {0u, 12345u, 900000u}) {
    const std::uint64_t most = partThatFits(device, 1000000, 10, sizes, reserved, "");
    EXPECT_TRUE(arraysFit(device, sizes(most), reserved));
    EXPECT_FALSE(arraysFit(device, sizes(most + 1), reserved)) << most;
  }
  const Buffer most = device.createBuffer(1 << 20);
}

TEST_F(Budget, RunsAreSortedIntoTheOrderOfAll) {
  const std::vector<SplatParticle> particles = splats(30000);
  for (const bool staged : {false, true}) {
    const std::uint64_t budget = 300000;  // 7500 particles of 40 bytes: 5 runs, of which 4 are full
    ASSERT_LT(budget, 30000u / 4 * 40 + 1);
    const SmallDevice small(budget, staged);
    double seconds = 0;
    EXPECT_EQ(depthOrderInRuns(small.device(), particles, camera(), kKeyScale, seconds),
              sortByDepth(particles, camera(), kKeyScale));
    EXPECT_GT(seconds, 0);
    EXPECT_TRUE(depthOrderInRuns(small.device(), {}, camera(), kKeyScale, seconds).empty());
  }
}

TEST_F(Budget, SplatsInPartsAreThePictureOfAll) {
  SplatSet set = plainSet(30000);
  const Image whole = drawWhole(set, {}, {.depth = true});
  for (const bool staged : {false, true}) {
    const std::uint64_t budget = 250000;
    ASSERT_LT(budget * 4, 36u * 30000) << "at least five parts, whatever the picture takes";
    const SmallDevice small(budget, staged);
    FrameStats stats;
    const auto rasterizer = deviceRasterizer(small.device(), set, kKeyScale, stats);
    EXPECT_EQ(rasterizer->order(), sortByDepth(set.particles, camera(), kKeyScale));
    expectSame(rasterizer->draw({}, {.depth = true}), whole);
    expectSame(rasterizer->draw({}, {.depth = true}), whole);  // nothing is left over from the first
    EXPECT_GT(stats.deviceSeconds["sort"], 0);
    EXPECT_GT(stats.deviceSeconds["splat"], 0);
  }
}

TEST_F(Budget, FullSplatsInPartsAreThePictureOfAllWithEveryLayer) {
  SplatSet set = everything(30000);
  const SplatLayers all{.depth = true, .opticalDepth = true, .velocity = true, .colorAlpha = true};
  std::vector<float> surfaces(kWidth * kHeight, 1000);
  for (std::size_t p = 0; p < surfaces.size(); p += 3) surfaces[p] = 3.9f;
  for (std::size_t p = 1; p < surfaces.size(); p += 30) surfaces[p] = layout::kPixelLeftOut;
  const Image whole = drawWhole(set, surfaces, all), clear = drawWhole(set, {}, {});

  const std::uint64_t budget = 450000;
  ASSERT_LT(budget * 4, 72u * 30000) << "at least five parts, whatever the picture takes";
  const SmallDevice small(budget);
  FrameStats stats;
  const auto rasterizer = deviceRasterizer(small.device(), set, kKeyScale, stats);
  expectSame(rasterizer->draw(surfaces, all), whole);
  expectSame(rasterizer->draw({}, {}), clear);
  EXPECT_GT(stats.deviceSeconds["splat"], 0);
}

TEST_F(Budget, SplatsLeaveTheDeviceWhereAPictureNeedsTheRoom) {
  // Sorted and kept there at once; then a picture with everything takes more than they leave.
  SplatSet set = everything(4000);
  const SplatLayers all{.depth = true, .opticalDepth = true, .velocity = true, .colorAlpha = true};
  const std::vector<float> surfaces(kWidth * kHeight, 3.9f);
  const Image whole = drawWhole(set, surfaces, all);
  const std::uint64_t particles = 72 * 4000, pairs = 8 * 4001, slack = 4096;
  const SmallDevice small(particles + pairs + slack);
  FrameStats stats;
  const auto rasterizer = deviceRasterizer(small.device(), set, kKeyScale, stats);
  EXPECT_GE(small.device().budget().held(), particles) << "they are kept";
  expectSame(rasterizer->draw(surfaces, all), whole);
  EXPECT_LT(small.device().budget().held(), particles);
}

TEST_F(Budget, OtherLightWithoutEmissionIsDrawnInPartsAsAtOnce) {
  const SplatSet set = everything(20000);
  std::vector<SplatParticle> other = set.particles;
  for (SplatParticle& particle : other) particle.radiance = vec3(particle.radiance.z, 0.5f, 0);
  const SmallDevice small(450000);
  for (const bool emission : {true, false}) {
    Image pictures[2];
    const Device* devices[] = {&device(), &small.device()};
    for (int k = 0; k < 2; ++k) {
      FrameStats stats;
      SplatSet own = set;
      const auto rasterizer = deviceRasterizer(*devices[k], own, kKeyScale, stats);
      const Image before = rasterizer->draw({}, {});
      rasterizer->relight(other, emission);
      pictures[k] = rasterizer->draw({}, {});
      EXPECT_FALSE(pictures[k].pixels == before.pixels);
    }
    expectSame(pictures[1], pictures[0]);
  }
}

TEST_F(Budget, NothingToDrawIsAClearedPicture) {
  const SmallDevice small(200000);
  FrameStats stats;
  SplatSet none = plainSet(0);
  const auto rasterizer = deviceRasterizer(small.device(), none, 1, stats);
  EXPECT_TRUE(rasterizer->order().empty());
  for (const vec4& p : rasterizer->draw({}, {.depth = true}).pixels) ASSERT_EQ(p, vec4(0));
}

TEST_F(Budget, TreesInPartsGiveTheLightOfAll) {
  for (const bool colors : {false, true}) {
    const Octree tree = ballTree(200000, colors);
    std::vector<float> x, y, z;
    std::vector<std::uint32_t> self;
    for (std::uint32_t k = 0; k < 2000; ++k) {  // from every part, and points of no particle
      const std::uint32_t slot = k / 250 * 25000 + k % 250;
      const vec3 p = tree.position(slot) + (k % 2 == 0 ? vec3(0) : vec3(0.01f));
      x.push_back(p.x), y.push_back(p.y), z.push_back(p.z), self.push_back(k % 2 == 0 ? slot : kNoSlot);
    }
    const Receivers receivers{x, y, z, self};
    const SmallDevice small(3 << 20);
    const LightingOptions rules;
    LightPass whole(device(), rules.falloff, rules.endpoint), inParts(small.device(), rules.falloff, rules.endpoint);
    whole.setTree(tree), inParts.setTree(tree);
    EXPECT_EQ(whole.parts(), 1u);
    EXPECT_GE(inParts.parts(), 5u);
    for (const layout::Light& light : {pointLight({2, 3, 1}), directionalLight({0, -1, -0.3f}), pointLight({0, 0, 0})})
      for (const float cutoff : {0.0f, 0.05f}) {
        const LightingOptions options{.cutoff = cutoff};
        std::size_t done = 0;
        const std::vector<float> got =
            inParts.opticalDepths(receivers, light, options, {}, [&](std::size_t rays) { done += rays; });
        const std::vector<float> sameDevice = whole.opticalDepths(receivers, light, options);
        const std::vector<float> host = opticalDepths(tree, receivers, light, options);
        ASSERT_EQ(got.size(), host.size());
        double fromHost = 0, fromWhole = 0;
        for (std::size_t i = 0; i < got.size(); ++i) {
          const double t = std::exp(-double(got[i]));
          fromHost = std::max(fromHost, std::abs(t - std::exp(-double(host[i]))));
          fromWhole = std::max(fromWhole, std::abs(t - std::exp(-double(sameDevice[i]))));
        }
        std::printf("%s cutoff %.2f: worst |dT| in parts %.1e from the host, %.1e from the whole tree\n",
                    colors ? "RGB" : "grey", cutoff, fromHost, fromWhole);
        // As mote crosscheck; and sums of the same numbers in another order, a few thousand of them, are 1e-6 apart.
        EXPECT_LE(fromHost, std::max(2e-5f, cutoff));
        EXPECT_LE(fromWhole, std::max(1e-6f, cutoff));
        if (cutoff == 0) {
          EXPECT_EQ(done, receivers.size());
        }
      }
    EXPECT_EQ(inParts.opticalDepths(receivers, pointLight({2, 3, 1}), {}),
              inParts.opticalDepths(receivers, pointLight({2, 3, 1}), {}))
        << "the same bits every time";
  }
}

TEST_F(Budget, TreeThatWouldFitWithoutItsRaysIsCut) {
  const Octree tree = ballTree(100000, false);
  const std::uint64_t bytes = tree.nodes.size() * 32 + 100000 * 20;
  const SmallDevice small(bytes + (1 << 20));
  LightPass pass(small.device(), layout::kFalloffSmooth, layout::kEndpointSoft);
  pass.setTree(tree);
  EXPECT_GE(pass.parts(), 2u);
  const LightingOptions options{.cutoff = 0};
  const std::vector<float> got = pass.opticalDepths(pointLight({2, 3, 1}), options);
  const std::vector<float> host = opticalDepths(tree, pointLight({2, 3, 1}), options);
  double worst = 0;
  for (std::size_t i = 0; i < host.size(); ++i)
    worst = std::max(worst, std::abs(std::exp(-double(got[i])) - std::exp(-double(host[i]))));
  EXPECT_LE(worst, 2e-5);
}

TEST_F(Budget, LightsByAGridInBatchesToTheSameBits) {
  std::vector<vec3> position;
  for (std::size_t i = 0; i < 30000; ++i) {
    Random r(19, i);
    position.emplace_back(r.direction() * std::cbrt(r.uniform()));
  }
  const std::vector<float> radius(position.size(), 0.03f), peak(position.size(), 0.02f), half(position.size(), 0.01f);
  for (const bool colours : {false, true}) {
    const Octree tree =
        colours ? buildOctree({position, radius, peak, half, peak}) : buildOctree(position, radius, peak);
    const auto lit = [&](const Device& device) {
      LightGridPass pass(device);
      return pass.opticalDepths(tree, slotsOf(tree), pointLight({2, 3, 1}), {}, {0.004, 0.03});
    };
    const std::vector<float> whole = lit(device());
    for (const bool stageAlways : {false, true}) {
      const SmallDevice small(12u << 20, stageAlways);
      EXPECT_EQ(lit(small.device()), whole);
    }
  }
}

}  // namespace
}  // namespace mote
