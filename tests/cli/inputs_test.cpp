// What mote does with inputs that are not as they should be, and with those that are far away or between frames.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/cli/mote_program.h"

namespace mote {
namespace {

using nlohmann::json;
using namespace test;
using Arguments = std::vector<std::string>;

ProcessResult render(const std::string& scene, Arguments more) {
  Arguments arguments{"render", scene, "--lighting", "cpu", "--raster", "cpu"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return test::mote(arguments, kWithoutVulkan);
}

std::string sceneIn(const TempFolder& folder, const std::string& text) {
  writeBytes(folder.file("scene.json"), text);
  return folder.file("scene.json");
}

// ---- particles that are none ----

/// 300 particles of which the second has no size.
std::string damagedScene(const TempFolder& folder) {
  std::vector<vec3> position;
  for (int i = 0; i < 300; ++i) position.push_back(vec3(i % 10, i / 10 % 10, i / 100));
  std::vector<float> radius(position.size(), 1);
  radius[1] = 0;
  const PrtColumn columns[] = {PrtColumn::of("Position", position), PrtColumn::of("Radius", radius)};
  writePrt(folder.file("a.prt"), columns);
  return sceneIn(folder, R"({"particles": [{"file": "a.prt"}], "output": {"size": [32, 24]}})");
}

TEST(Inputs, ParticlesThatAreNoneAreCountedAndLeftOut) {
  const TempFolder folder;
  const std::string scene = damagedScene(folder), stats = folder.file("stats.json");
  const ProcessResult result = render(scene, {"-o", folder.file("out.exr"), "--stats", stats});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.err, "a.prt: 1 of 300 particles left out: 1 whose radius is not a finite number > 0"));
  const json frame = json::parse(test::readBytes(stats))["frames"][0];
  EXPECT_EQ(frame["particles"], 299);
  ASSERT_EQ(frame["warnings"].size(), 1u);
  EXPECT_TRUE(contains(frame["warnings"][0].get<std::string>(), "1 of 300 particles left out"));
}

TEST(Inputs, StrictRefusesThemInEveryCommandThatTakesAScene) {
  const TempFolder folder;
  const std::string scene = damagedScene(folder);
  const std::string message = "a.prt: particle 1: radius: expected a finite number > 0, got 0";
  for (const Arguments& arguments :
       {Arguments{"render", scene, "--strict", "-o", folder.file("out.exr"), "--lighting", "cpu", "--raster", "cpu"},
        Arguments{"light", scene, "--strict", "-o", folder.file("lit.prt"), "--lighting", "cpu"}}) {
    const ProcessResult result = test::mote(arguments, kWithoutVulkan);
    EXPECT_EQ(result.exitCode, 2) << result.err;
    EXPECT_TRUE(contains(result.err, message)) << arguments[0];
  }
  const ProcessResult crosscheck = test::mote({"crosscheck", scene, "--strict"}, test::kOnLavapipe);
  EXPECT_EQ(crosscheck.exitCode, 2) << crosscheck.err;
  EXPECT_TRUE(contains(crosscheck.err, message));
  EXPECT_EQ(folder.entries().size(), 2u);
}

// ---- sequences ----

TEST(Inputs, GapsAreRefusedBeforeAnyWorkOrHeld) {
  const TempFolder folder;
  makeBall(folder, "b.0001.prt");
  makeBall(folder, "b.0002.prt");
  const std::string scene = sceneIn(
      folder,
      R"({"particles": [{"file": "b.%04d.prt"}], "output": {"size": [32, 24]}, "frames": {"first": 1, "last": 4}})");
  const Arguments output{"-o", folder.file("out.%02d.exr")};
  ProcessResult result = render(scene, output);
  EXPECT_EQ(result.exitCode, 2) << result.err;
  EXPECT_TRUE(contains(result.err, "b.%04d.prt: expected a file for every frame of 1-4, got none for frames 3-4"));
  EXPECT_EQ(folder.entries().size(), 3u);

  const std::string stats = folder.file("stats.json");
  result = render(scene, {"-o", folder.file("out.%02d.exr"), "--missing", "hold", "--stats", stats});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const json frames = json::parse(test::readBytes(stats))["frames"];
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_TRUE(contains(frames[3]["warnings"][0].get<std::string>(), "b.0004.prt: no such file; frame 2 is held"));
  EXPECT_TRUE(contains(frames[3]["inputs"][0]["file"].get<std::string>(), "b.0002.prt"));
  EXPECT_EQ(readExr(folder.file("out.02.exr")).pixels, readExr(folder.file("out.04.exr")).pixels);

  result = render(scene, {"--missing", "skip"});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, "--missing: expected error or hold, got \"skip\""));
}

// ---- far from the origin ----

/// A scene of 500 particles about `at`, all places written out there.
std::string sceneAt(const TempFolder& folder, const std::string& name, const dvec3& at) {
  std::vector<dvec3> position;
  for (int i = 0; i < 500; ++i)
    position.push_back(at + dvec3(i % 8 * 0.125, i / 8 % 8 * 0.125, i / 64 * 0.125));  // exact in float32 as well
  const std::vector<vec3> zero(position.size(), vec3(0));
  const PrtColumn columns[] = {PrtColumn::raw("P64", NumberType::F64, 3, std::as_bytes(std::span(position))),
                               PrtColumn::of("Position", zero)};
  writePrt(folder.file(name + ".prt"), columns);
  const auto place = [&](double x, double y, double z) {
    return fmt::format("[{}, {}, {}]", at.x + x, at.y + y, at.z + z);
  };
  writeBytes(folder.file(name + ".obj"), "v -1 -0.25 -1\nv 2 -0.25 -1\nv 2 -0.25 2\nv -1 -0.25 2\nf 1 4 3 2\n");
  writeBytes(folder.file(name + ".json"),
             fmt::format(R"({{
    "particles": [{{"file": "{0}.prt", "channels": {{"Position": "P64"}}, "radius": 0.1}}],
    "lights": [{{"position": {1}, "intensity": 50}}],
    "solids": [{{"file": "{0}.obj", "translate": {2}}}],
    "camera": {{"position": {3}, "target": {4}, "keys": [{{"frame": 1, "target": {4}}}]}},
    "output": {{"size": [64, 48], "precision": "float", "aovs": ["Z"]}}
  }})",
                         name, place(2, 3, 1), place(0, 0, 0), place(0.5, 1, 4), place(0.5, 0.5, 0.5)));
  return folder.file(name + ".json");
}

TEST(Inputs, AShotInSurveyCoordinatesIsThePictureOfTheSameShotAtTheOrigin) {
  const TempFolder folder;
  ASSERT_EQ(render(sceneAt(folder, "near", dvec3(0)), {"-o", folder.file("near.exr")}).exitCode, 0);
  const std::string stats = folder.file("stats.json");
  const ProcessResult result = render(sceneAt(folder, "far", dvec3(512'340.75, 4'123'456.5, 212)),
                                      {"-o", folder.file("far.exr"), "--stats", stats});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.err, "all are measured from (512341, 4123457, 212.5)")) << result.err;
  const json origin = json::parse(test::readBytes(stats))["frames"][0]["origin"];
  EXPECT_EQ(exrStrings(folder.file("far.exr")).at("mote:origin"),
            fmt::format("{} {} {}", origin[0].get<double>(), origin[1].get<double>(), origin[2].get<double>()));
  EXPECT_FALSE(exrStrings(folder.file("near.exr")).contains("mote:origin"));
  const Image here = readExr(folder.file("near.exr")), there = readExr(folder.file("far.exr"));
  double worst = 0, brightest = 0;
  for (std::size_t i = 0; i < here.pixels.size(); ++i) {
    brightest = std::max(brightest, static_cast<double>(here.pixels[i].r));
    for (int c = 0; c < 4; ++c)
      worst =
          std::max(worst, std::abs(static_cast<double>(here.pixels[i][c]) - static_cast<double>(there.pixels[i][c])));
  }
  EXPECT_GT(brightest, 0.1);
  // Rounding of float32 about another origin; a shift by one of float32's steps of 0.25 would be 0.1 and more.
  EXPECT_LT(worst, 1e-3 * brightest);

  const std::string lit = folder.file("lit.prt");
  ASSERT_EQ(test::mote({"light", folder.file("far.json"), "-o", lit, "--lighting", "cpu"}, kWithoutVulkan).exitCode, 0);
  const auto file = openParticleFile(lit);
  const Metadata* kept = file->meta("", "Origin");
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->bytes.size(), 24u);
}

// ---- between frames ----

TEST(Inputs, MotionBlurFollowsTheCurveBetweenFrames) {
  const TempFolder folder;
  constexpr double kAngle = 1;  // rad a frame, about the origin
  for (const int frame : {1, 2}) {
    const double angle = kAngle * (frame - 1);
    const std::vector<vec3> position{vec3(std::cos(angle), std::sin(angle), 0)};
    const std::vector<vec3> velocity{vec3(-kAngle * std::sin(angle), kAngle * std::cos(angle), 0)};
    const std::vector<std::uint64_t> id{7};
    const PrtColumn columns[] = {PrtColumn::of("Position", position), PrtColumn::of("Velocity", velocity),
                                 PrtColumn::of("ID", id)};
    writePrt(folder.file(fmt::format("p.{}.prt", frame)), columns);
  }
  const std::string scene = sceneIn(folder, R"({
    "particles": [{"file": "p.#.prt", "radius": 0.2, "velocity_per": "frame"}], "medium": {"optical_depth": 1},
    "camera": {"type": "orthographic", "height": 4, "position": [0, 0, 5], "target": [0, 0, 0], "shutter": [0, 0.04]},
    "frames": {"fps": 25}, "output": {"size": [80, 80], "precision": "float"}})");
  const auto middle = [&](const char* how) {
    const ProcessResult result =
        render(scene, {"--set", fmt::format("/particles/0/interpolate=\"{}\"", how), "-o", folder.file("out.exr")});
    EXPECT_EQ(result.exitCode, 0) << result.err;
    const Image image = readExr(folder.file("out.exr"));
    dvec2 sum(0);
    double weight = 0;
    for (int y = 0; y < 80; ++y)
      for (int x = 0; x < 80; ++x) {
        const double a = -std::log1p(-static_cast<double>(image.at(x, y).a));
        sum += a * dvec2((x + 0.5) / 20 - 2, 2 - (y + 0.5) / 20), weight += a;
      }
    return sum / weight;
  };
  const dvec2 start(1, 0), end(std::cos(kAngle), std::sin(kAngle)), straight(1, kAngle);
  // A streak's middle is that of its ends; a tenth of a pixel is 0.005.
  EXPECT_LT(glm::distance(middle("hermite"), 0.5 * (start + end)), 0.005);
  EXPECT_LT(glm::distance(middle("velocity"), 0.5 * (start + straight)), 0.005);
}

}  // namespace
}  // namespace mote
