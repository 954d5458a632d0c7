// Whole pictures on the host: solids before, in and behind the medium, their light and shadows, every layer.
#include "engine/picture.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <set>

#include "engine/renderer.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/generate.h"
#include "host/scene/scene_reader.h"
#include "host/splat/splat.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::TempFolder;
using test::writeBytes;

/// A scene in a folder of its own, rendered on the host.
class Picture : public ::testing::Test {
 protected:
  void SetUp() override {
    writeBytes(folder.file("square.obj"), "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n");
    writeBytes(folder.file("triangle.obj"), "v -0.73 -0.61 0\nv 0.69 -0.47 0\nv -0.11 0.83 0\nf 1 2 3\n");
    one({0, 0, 0}, 1, 0);
  }

  /// particles.prt: one particle.
  void one(const vec3& position, float radius, float density) {
    const std::vector<vec3> positions{position};
    const std::vector<float> radii{radius}, densities{density};
    writePrt(folder.file("particles.prt"),
             std::vector<PrtColumn>{PrtColumn::of("Position", std::span<const vec3>(positions)),
                                    PrtColumn::of("Radius", std::span<const float>(radii)),
                                    PrtColumn::of("Density", std::span<const float>(densities))});
  }

  /// `parts`: keys beside "particles".
  Image render(const std::string& parts) {
    writeBytes(folder.file("scene.json"),
               R"({"particles": [{"file": "particles.prt", "radius": {"channel": "Radius"}}], )" + parts + "}");
    Scene scene = readScene(folder.file("scene.json"));
    FrameStats stats;
    frame = prepareFrame(scene, 1, stats);
    Renderer renderer({false, false}, nullptr);
    Image image = renderer.draw(frame, scene, renderer.light(frame, lightWanted(scene), stats), stats);
    drawn = stats.drawn;
    return image;
  }

  const ImageLayer& layer(const Image& image, const std::string& name) {
    for (const ImageLayer& candidate : image.layers)
      if (candidate.name == name) return candidate;
    throw std::runtime_error("no layer " + name);
  }

  TempFolder folder;
  Frame frame;
  std::size_t drawn = 0;  ///< particles of the last picture
};

// A camera 4 units before the plane z = 0, whose picture is 2.4 high there.
constexpr const char* kCamera =
    R"("camera": {"position": [0, 0, 4], "target": [0, 0, 0], "fov": 33.39849, "near": 0.1, "far": 100},)";
constexpr const char* kSun =
    R"("lights": [{"name": "sun", "type": "directional", "direction": [0, 0, -1], "irradiance": 3}],)";
constexpr const char* kPeak = R"("medium": {"density_mode": "peak", "density_scale": 1},)";

/// Area of the part of a triangle inside a pixel, by Sutherland and Hodgman's clipping, in double.
double coveredArea(std::vector<dvec2> polygon, double left, double top) {
  const auto clip = [&](auto inside, auto cut) {
    std::vector<dvec2> result;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const dvec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      if (inside(a)) result.push_back(a);
      if (inside(a) != inside(b)) result.push_back(a + (b - a) * cut(a, b));
    }
    polygon = result;
  };
  for (const int axis : {0, 1}) {
    const double low = axis == 0 ? left : top;
    clip([&](const dvec2& p) { return p[axis] >= low; },
         [&](const dvec2& a, const dvec2& b) { return (low - a[axis]) / (b[axis] - a[axis]); });
    clip([&](const dvec2& p) { return p[axis] <= low + 1; },
         [&](const dvec2& a, const dvec2& b) { return (low + 1 - a[axis]) / (b[axis] - a[axis]); });
  }
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const dvec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    area += 0.5 * (a.x * b.y - a.y * b.x);
  }
  return std::fabs(area);
}

TEST_F(Picture, EdgesOfSolidsHaveTheExactAreaOfThePixelAsAlpha) {
  const Image image =
      render(std::string(kCamera) + kSun + kPeak +
             R"("solids": [{"name": "t", "file": "triangle.obj", "mode": "shaded"}], "output": {"size": [120, 120]})");
  const auto onPicture = [&](double x, double y) {
    const double scale = 1 / (4 * double(frame.view.pixelSize));
    return dvec2(60 + x * scale, 60 - y * scale);
  };
  const std::vector<dvec2> triangle{onPicture(-0.73, -0.61), onPicture(0.69, -0.47), onPicture(-0.11, 0.83)};
  double worst = 0, mean = 0;
  int edges = 0;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 120; ++x) {
      const double area = coveredArea(triangle, x, y), error = std::fabs(image.at(x, y).w - area);
      worst = std::max(worst, error);
      if (area > 0 && area < 1)
        mean += error, ++edges;
      else
        ASSERT_EQ(image.at(x, y).w, static_cast<float>(area)) << x << ' ' << y;
    }
  ASSERT_GT(edges, 150);
  std::printf("coverage of %d edge pixels: worst %.3f, mean %.3f\n", edges, worst, mean / edges);
  EXPECT_LE(worst, 0.05);  // 64 rays
  EXPECT_LE(mean / edges, 0.015);
}

TEST_F(Picture, ShadedSolidsFollowLambertsLaw) {
  const Image image =
      render(std::string(kCamera) + kPeak +
             R"("lights": [{"name": "sun", "type": "directional", "direction": [1, 0, -1], "irradiance": 3},
                                           {"name": "lamp", "type": "point", "position": [0, 0, 2], "intensity": 5},
                                           {"name": "behind", "type": "point", "position": [0, 0, -2], "intensity": 500}],
                                "solids": [{"name": "s", "file": "square.obj", "albedo": [0.2, 0.4, 0.8]}],
                                "output": {"size": [41, 41], "aovs": ["Z", "lights", "shadow"]})");
  const double expected = (3 * std::sqrt(0.5) + 5 / 4.0) / kPi;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.at(20, 20)[c], expected * (c == 0 ? 0.2 : c == 1 ? 0.4 : 0.8), 1e-4);
  EXPECT_EQ(image.at(20, 20).w, 1);
  EXPECT_NEAR(image.depth[20 * 41 + 20], 4, 1e-5);
  EXPECT_EQ(image.depth[0], kNoDepth);
  EXPECT_EQ(layer(image, "light.behind.R").values[20 * 41 + 20], 0);
  EXPECT_NEAR(layer(image, "light.lamp.B").values[20 * 41 + 20], 5 / 4.0 / kPi * 0.8, 1e-4);
  EXPECT_EQ(layer(image, "shadow.sun").values[20 * 41 + 20], 1);
}

TEST_F(Picture, HoldoutsCutTheMediumAndHaveNoAlpha) {
  one({0, 0, 0}, 1.5f, 1.1f);
  const std::string rest = std::string(kCamera) + kSun + kPeak;
  const std::string size = R"("output": {"size": [61, 61], "aovs": ["Z", "optical_depth"]})";
  const auto with = [&](float z) {
    return render(
        rest +
        fmt::format(
            R"("solids": [{{"name": "s", "file": "square.obj", "mode": "holdout", "scale": 0.5, "translate": [0, 0, {}]}}],)",
            z) +
        size);
  };
  const Image none = render(rest + size), before = with(2), middle = with(0), behind = with(-2);
  const std::size_t centre = 30 * 61 + 30, corner = 3 * 61 + 30;
  ASSERT_NEAR(none.at(30, 30).w, 1 - std::exp(-1.1), 1e-3);
  EXPECT_EQ(before.at(30, 30), vec4(0));
  EXPECT_NEAR(middle.at(30, 30).w, 1 - std::exp(-0.55), 1e-3);
  EXPECT_NEAR(middle.opticalDepth[centre], 0.55, 1e-3);
  EXPECT_EQ(behind.at(30, 30), none.at(30, 30));
  for (const Image* image : {&before, &middle, &behind})
    EXPECT_NEAR(image->opticalDepth[corner], none.opticalDepth[corner], 1e-6);  // beside the solid nothing changes
  EXPECT_EQ(before.depth[centre], kNoDepth);
}

TEST_F(Picture, HoldoutsAndShadedSolidsOfOnePixelStayApartHoweverManyThereAre) {
  one({0, 0, 0}, 1, 0);
  // Five strips side by side, each a solid of its own and deeper than the one before; the picture is one pixel.
  const float edges[] = {-1, -0.25f, 0.25f, 0.5f, 0.75f, 1};
  for (int strip = 0; strip < 5; ++strip)
    writeBytes(folder.file(fmt::format("strip{}.obj", strip)),
               fmt::format("v {0} -2 {2}\nv {1} -2 {2}\nv {1} 2 {2}\nv {0} 2 {2}\nf 1 2 3 4\n", edges[strip],
                           edges[strip + 1], -strip));
  // Which strips are holdouts; A is what the others cover.
  for (const std::set<int>& holdouts : {std::set<int>{3}, {0}, {1, 3}, {0, 1, 2, 3}, {}}) {
    std::string solids;
    double expected = 0;
    for (int strip = 0; strip < 5; ++strip) {
      const bool holdout = holdouts.contains(strip);
      if (!holdout) expected += (edges[strip + 1] - edges[strip]) / 2;
      solids += fmt::format(R"({}{{"name": "s{}", "file": "strip{}.obj", "mode": "{}"}})", strip > 0 ? ", " : "", strip,
                            strip, holdout ? "holdout" : "shaded");
    }
    const Image image =
        render(R"("camera": {"type": "orthographic", "position": [0, 0, 4], "target": [0, 0, 0], "height": 2},)" +
               std::string(kSun) + kPeak + R"("solids": [)" + solids + R"(], "output": {"size": [1, 1]})");
    EXPECT_NEAR(image.at(0, 0).w, expected, 1e-6) << holdouts.size();  // edges are whole 64ths of the pixel
    EXPECT_NEAR(image.at(0, 0).x, expected * 0.5 * 3 / kPi, 1e-5) << holdouts.size();  // Lambert, albedo 0.5
  }
}

TEST_F(Picture, EdgesAgainstTheMediumMixBothSidesByCoverageWithoutAHalo) {
  one({0, 0, -1}, 40, 6);  // fog, the same all over the picture
  const std::string rest = std::string(kCamera) + kSun + kPeak;
  const std::string output = R"("output": {"size": [80, 80]})";
  for (const char* mode : {"shaded", "holdout"}) {
    const std::string solid = fmt::format(
        R"("solids": [{{"name": "t", "file": "triangle.obj", "albedo": [0, 0, 0], "casts_shadows": false, "mode": "{}"}}],)",
        mode);
    const Image image = render(rest + solid + output), fog = render(rest + output);
    // Fully covered: by the fog between camera and triangle, the same everywhere but for the slant of the ray.
    const vec4 inside = image.at(39, 42);
    int edges = 0;
    for (int y = 0; y < 80; ++y)
      for (int x = 0; x < 80; ++x)
        for (int c = 0; c < 4; ++c) {
          const float low = std::min(inside[c], fog.at(x, y)[c]), high = std::max(inside[c], fog.at(x, y)[c]);
          ASSERT_GE(image.at(x, y)[c], low - 0.02f * high) << x << ' ' << y << ' ' << c;
          ASSERT_LE(image.at(x, y)[c], high + 0.02f * high) << x << ' ' << y << ' ' << c;
          edges +=
              c == 0 && image.at(x, y)[c] > low + 0.1f * (high - low) && image.at(x, y)[c] < high - 0.1f * (high - low);
        }
    EXPECT_GT(edges, 50);
  }
}

TEST_F(Picture, TheMediumsShadowOnASolidIsItsTransmittanceThere) {
  one({0, 0, 1}, 0.8f, 1.3f);
  for (const char* mode : {"shaded", "holdout"}) {
    const Image image =
        render(R"("camera": {"position": [3, 0, 3], "target": [0, 0, 0], "fov": 40},)" + std::string(kSun) + kPeak +
               fmt::format(R"("solids": [{{"name": "s", "file": "square.obj", "mode": "{}"}}],
                      "output": {{"size": [101, 101], "aovs": ["shadow", "Z"]}})",
                           mode));
    const ImageLayer& shadow = layer(image, "shadow.sun");
    const layout::SplatCamera& c = frame.view;
    int dark = 0, lit = 0;
    for (int y = 0; y < 101; ++y)
      for (int x = 0; x < 101; ++x) {
        const dvec3 ray = (x + 0.5 - 50.5) * double(c.pixelSize) * dvec3(c.right) +
                          (50.5 - (y + 0.5)) * double(c.pixelSize) * dvec3(c.up) + dvec3(c.forward);
        const dvec3 point = dvec3(c.position) - ray * (double(c.position.z) / ray.z);
        const float value = shadow.values[static_cast<std::size_t>(y) * 101 + static_cast<std::size_t>(x)];
        if (std::max(std::fabs(point.x), std::fabs(point.y)) > 1.05) {
          ASSERT_EQ(value, 1) << x << ' ' << y;
          continue;
        }
        if (std::max(std::fabs(point.x), std::fabs(point.y)) > 0.95) continue;  // an edge
        const double q = (point.x * point.x + point.y * point.y) / 0.64;
        const double expected = q < 1 ? std::exp(-1.3 * (1 - q) * (1 - q)) : 1;
        ASSERT_NEAR(value, expected, 0.02) << x << ' ' << y;  // one ray of the pixel, not its centre
        dark += expected<0.5, lit += expected> 0.99;
      }
    EXPECT_GT(dark, 50);
    EXPECT_GT(lit, 100);
  }
}

TEST_F(Picture, SolidsShadowParticlesAndEachOtherAsFarAsTheyMay) {
  one({0, 0, -1}, 0.3f, 0.5f);
  writeBytes(folder.file("wall.obj"), "v -3 -3 -2\nv 3 -3 -2\nv 3 3 -2\nv -3 3 -2\nf 1 2 3 4\n");
  const auto radiance = [&](const std::string& block, const std::string& more = "") {
    return render(std::string(kCamera) + kSun + kPeak + more + R"("solids": [)" + block +
                  R"({"name": "wall", "file": "wall.obj"}],
                     "output": {"size": [41, 41], "aovs": ["lights", "shadow"]})");
  };
  const auto block = [](const char* keys) {
    return fmt::format(R"({{"name": "block", "file": "square.obj", "translate": [0, 0, 1], "mode": "hidden"{}}},)",
                       keys);
  };
  const std::size_t centre = 20 * 41 + 20;
  const Image open = radiance(""), hidden = radiance(block("")),
              passing = radiance(block(R"(, "casts_shadows": false)"));
  EXPECT_GT(open.at(20, 20).x, 0.1f);
  EXPECT_EQ(vec3(hidden.at(20, 20)), vec3(0));  // particle and wall lie in the shadow of what is not seen
  EXPECT_EQ(layer(hidden, "shadow.sun").values[centre], 0);
  EXPECT_EQ(passing.at(20, 20), open.at(20, 20));
  const Image half = radiance(block(""), R"("lighting": {"solid_shadow_intensity": 0.5},)");
  EXPECT_NEAR(half.at(20, 20).x, 0.5f * open.at(20, 20).x, 1e-5f);
  EXPECT_NEAR(layer(half, "shadow.sun").values[centre], 0.5f * layer(open, "shadow.sun").values[centre], 1e-5f);
  EXPECT_LT(layer(open, "shadow.sun").values[centre], 0.7f);  // the particle's own shadow on the wall
  const Image deaf = render(std::string(kCamera) + kSun + kPeak + R"("solids": [)" + block("") +
                            R"({"name": "wall", "file": "wall.obj", "receives_shadows": false}],
                               "output": {"size": [41, 41], "aovs": ["shadow"]})");
  EXPECT_EQ(layer(deaf, "shadow.sun").values[centre], 1);
}

/// 3,000 particles with colour, absorption, emission and velocity.
void writeBall(const std::string& path) {
  ParticleSet set = generateBall(3000, 5);
  std::vector<vec3> absorption, emission;
  for (std::size_t i = 0; i < set.size(); ++i) {
    const float s = static_cast<float>(i % 17) / 17;
    set.color.emplace_back(s, 1 - s, 0.5f);
    absorption.emplace_back(0.3f * s, 0.1f, 0.6f);
    emission.push_back(i % 50 == 0 ? vec3(2, 0.6f, 0.1f) : vec3(0));
    set.velocity.emplace_back(set.position[i].z, 1.0f, -set.position[i].x);
  }
  std::vector<PrtColumn> columns = columnsOf(set);
  columns.push_back(PrtColumn::of("Absorption", std::span<const vec3>(absorption)));
  columns.push_back(PrtColumn::of("Emission", std::span<const vec3>(emission)));
  writePrt(path, columns);
}

/// The layers of lights and emission, added up, must be the picture; returns the brightest channel of a pixel.
double brightestOfLayersThatSumToThePicture(const Image& image) {
  double brightest = 0;
  std::size_t wrong = 0;
  for (std::size_t p = 0; p < image.pixels.size(); ++p)
    for (int c = 0; c < 3; ++c) {
      double sum = 0;
      for (const ImageLayer& one : image.layers)
        if (one.name.back() == "RGB"[c]) sum += one.values[p];
      wrong += !(std::abs(sum - image.pixels[p][c]) <= 2e-6 + 2e-6 * image.pixels[p][c]);
      brightest = std::max(brightest, sum);
    }
  EXPECT_EQ(wrong, 0u);
  return brightest;
}

TEST_F(Picture, LightLayersAndEmissionSumToTheBeauty) {
  writeBall(folder.file("particles.prt"));
  const Image image = render(std::string(kCamera) +
                             R"("medium": {"optical_depth": 3},
                                "lights": [{"name": "key", "type": "spot", "position": [2, 2, 2], "target": [0, 0, 0], "intensity": 40, "inner_angle": 10, "outer_angle": 30},
                                           {"name": "sun", "type": "directional", "direction": [1, -1, -0.5], "irradiance": 3, "color": [0.3, 0.6, 1]},
                                           {"name": "fill", "position": [-3, 1, 1], "intensity": 4}],
                                "solids": [{"name": "t", "file": "triangle.obj", "translate": [0.2, 0, 0.3]},
                                           {"name": "s", "file": "square.obj", "mode": "holdout", "translate": [-1.2, 0, -0.1]}],
                                "output": {"size": [96, 64], "aovs": ["lights"]})");
  ASSERT_EQ(image.layers.size(), 12u);
  EXPECT_GT(brightestOfLayersThatSumToThePicture(image), 0.1);
  double emitted = 0;
  for (const char* name : {"emission.R", "emission.G", "emission.B"})
    for (const float value : layer(image, name).values) emitted += value;
  EXPECT_GT(emitted, 1);
}

TEST_F(Picture, LightLayersOfAPlainSceneSumToTheBeautyToo) {
  writeBall(folder.file("particles.prt"));
  const Image image = render(std::string(kCamera) +
                             R"("medium": {"optical_depth": 3, "emission_scale": 0},
                                "lights": [{"name": "a", "position": [2, 2, 2], "intensity": 40},
                                           {"name": "b", "position": [-2, 2, 1], "intensity": 30}],
                                "output": {"size": [96, 64], "aovs": ["lights", "Z", "velocity", "optical_depth"]})");
  ASSERT_EQ(image.layers.size(), 6u);
  EXPECT_GT(brightestOfLayersThatSumToThePicture(image), 0.1);
  EXPECT_EQ(image.alpha.size(), image.pixels.size());
  EXPECT_EQ(image.velocity.size(), image.pixels.size());
  EXPECT_EQ(image.opticalDepth.size(), image.pixels.size());
}

/// Sort and splats see only what is in view; light layers, which come later, still find their particles.
TEST_F(Picture, DrawsOnlyParticlesInView) {
  writeBall(folder.file("particles.prt"));
  const auto seen = [&](const char* target) {
    return render(fmt::format(
        R"("camera": {{"position": [0, 0, 4], "target": {}, "fov": 8, "near": 0.1, "far": 100}},
           "lights": [{{"name": "a", "position": [2, 2, 2], "intensity": 40}},
                      {{"name": "b", "position": [-2, 2, 1], "intensity": 30}}],
           "output": {{"size": [48, 32], "aovs": ["lights", "Z", "velocity"]}})",
        target));
  };
  const Image image = seen("[0.2, 0.1, 0]");
  EXPECT_GT(drawn, 0u);
  EXPECT_LT(drawn, frame.particles.size() / 2);
  EXPECT_GT(brightestOfLayersThatSumToThePicture(image), 0.01);
  const Image elsewhere = seen("[0, 0, 9]");
  EXPECT_EQ(drawn, 0u);
  for (const vec4& pixel : elsewhere.pixels) ASSERT_EQ(pixel, vec4(0));
}

TEST_F(Picture, LightingCastsOneRayAParticleAndLight) {
  writeBall(folder.file("particles.prt"));
  for (const double share : {1.0, 0.2})
    for (const int lights : {0, 1, 2, 5}) {
      std::string list;
      for (int l = 0; l < lights; ++l)
        list += fmt::format(R"({}{{"name": "l{}", "position": [{}, 2, 2]}})", l > 0 ? ", " : "", l, l);
      writeBytes(folder.file("scene.json"), fmt::format(R"({{"particles": [{{"file": "particles.prt"}}], "lights": [{}],
                                 "lighting": {{"subsample": {}}}}})",
                                                        list, share));
      Scene scene = readScene(folder.file("scene.json"));
      FrameStats stats;
      frame = prepareFrame(scene, 1, stats);
      std::atomic<std::size_t> rays{0};
      ShadowSources sources = hostShadows(frame);
      const OpticalDepthSource host = sources.opticalDepths;
      sources.opticalDepths = [&](const Receivers& receivers, const layout::Light& light,
                                  std::span<const std::uint8_t> reached, const RaysDone& done) {
        return host(receivers, light, reached, [&](std::size_t count) {
          rays += count;
          done(count);
        });
      };
      lightParticles(frame, sources, {});
      EXPECT_EQ(rays, static_cast<std::size_t>(lights) * 3000) << share;
    }
}

TEST_F(Picture, SolidsMoveOnThePictureWithTheCamera) {
  const Image image =
      render(R"("camera": {"position": [0, 0, 4], "target": [0, 0, 0], "fov": 33.39849, "keys": [
                                  {"frame": 0, "position": [-0.5, 0, 4], "target": [-0.5, 0, 0]}, {"frame": 2, "position": [0.5, 0, 4], "target": [0.5, 0, 0]}]},)" +
             std::string(kSun) + kPeak +
             R"("solids": [{"name": "s", "file": "square.obj"}], "output": {"size": [40, 40], "aovs": ["velocity"]})");
  const vec2 velocity = image.velocity[20 * 40 + 20];
  EXPECT_NEAR(velocity.x, -0.5 / (4 * double(frame.view.pixelSize)), 0.01);
  EXPECT_NEAR(velocity.y, 0, 0.01);
  EXPECT_EQ(image.velocity[0], vec2(0));
}

}  // namespace
}  // namespace mote
