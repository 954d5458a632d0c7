// mote render from the outside: what it writes, what it refuses before any work, and what it leaves behind.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/core/random.h"
#include "host/image/exr.h"
#include "host/image/png.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/cli/mote_program.h"

namespace mote {
namespace {

using nlohmann::json;
using namespace test;
using Arguments = std::vector<std::string>;

constexpr const char* kBallScene = R"({"particles": [{"file": "ball.prt"}], "output": {"size": [64, 48]}})";

/// A folder with a small scene in it, rendered on the host so that no driver has a say.
class MoteRender : public testing::Test {
 protected:
  MoteRender() { writeBytes(scene_, kBallScene); }

  ProcessResult render(Arguments more, const ProcessOptions& options = kWithoutVulkan) const {
    Arguments arguments{"render", scene_, "--lighting", "cpu", "--raster", "cpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::mote(arguments, options);
  }

  /// Renders to out.exr and expects a refusal that says `message` and leaves no more files than there were.
  void expectRefusal(const std::string& message, const Arguments& more = {}) const {
    const std::size_t before = folder_.entries().size();
    Arguments arguments{"-o", folder_.file("out.exr")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = render(arguments);
    EXPECT_EQ(result.exitCode, 2) << result.err;
    EXPECT_TRUE(contains(result.err, message));
    EXPECT_EQ(folder_.entries().size(), before);
  }

  TempFolder folder_;
  const std::string scene_ = folder_.file("scene.json");
};

// ---- pictures ----

TEST_F(MoteRender, WritesAPictureOfTheSizeAskedForWithoutVulkanAndSaysSoOnce) {
  makeBall(folder_);
  const ProcessResult result = render({"-o", folder_.file("out.exr")});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.out, "");
  const std::string said = "Vulkan is not used";
  const std::size_t first = result.err.find(said);
  ASSERT_NE(first, std::string::npos) << result.err;
  EXPECT_EQ(result.err.find(said, first + 1), std::string::npos) << result.err;

  const Image image = readExr(folder_.file("out.exr"));
  EXPECT_EQ(image.width, 64);
  EXPECT_EQ(image.height, 48);
  // A camera fitted to a ball: its middle is opaque (τ about 4) and lit, the corners are empty.
  EXPECT_GT(image.at(32, 24).a, 0.9f);
  EXPECT_GT(image.at(32, 24).r, 0);
  EXPECT_EQ(image.at(0, 0).a, 0);
}

TEST_F(MoteRender, AutoWithoutVulkanFallsBackToTheHost) {
  makeBall(folder_);
  const ProcessResult result = test::mote({"render", scene_, "-o", folder_.file("out.exr")}, kWithoutVulkan);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.err, "Vulkan is not used"));
}

TEST_F(MoteRender, AskingForTheGpuWithoutVulkanIsExitCode3) {
  makeBall(folder_);
  for (const char* flag : {"--lighting", "--raster"}) {
    const ProcessResult result =
        test::mote({"render", scene_, flag, "gpu", "-o", folder_.file("out.exr")}, kWithoutVulkan);
    EXPECT_EQ(result.exitCode, 3) << flag;
    EXPECT_TRUE(contains(result.err, "no Vulkan device"));
    EXPECT_FALSE(std::filesystem::exists(folder_.file("out.exr")));
  }
}

TEST_F(MoteRender, QuietPrintsNothing) {
  makeBall(folder_);
  const ProcessResult result = render({"-q", "-o", folder_.file("out.exr")});
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out, "");
}

TEST_F(MoteRender, GivesTheSameBytesOnAnyNumberOfThreads) {
  makeBall(folder_);
  ASSERT_EQ(render({"--threads", "1", "-o", folder_.file("one.exr")}).exitCode, 0);
  ASSERT_EQ(render({"--threads", "3", "-o", folder_.file("three.exr")}).exitCode, 0);
  const Image one = readExr(folder_.file("one.exr")), three = readExr(folder_.file("three.exr"));
  EXPECT_TRUE(one.pixels == three.pixels);
}

TEST_F(MoteRender, SizeFlagAndSetChangeTheScene) {
  makeBall(folder_);
  ASSERT_EQ(render({"--size", "20x10", "--set", "/medium/density_scale=0", "-o", folder_.file("out.exr")}).exitCode, 0);
  const Image image = readExr(folder_.file("out.exr"));
  EXPECT_EQ(image.width, 20);
  EXPECT_EQ(image.height, 10);
  for (const vec4& pixel : image.pixels) EXPECT_EQ(pixel.a, 0) << "a medium of density 0 is not there";
}

TEST_F(MoteRender, WritesEveryFrameOfARange) {
  writeBytes(scene_, R"({"particles": [{"generate": "plume", "count": 500}], "output": {"size": [32, 24]}})");
  ASSERT_EQ(render({"--frames", "20-30x10", "-o", folder_.file("p.####.exr"), "--preview", folder_.file("p.####.png")})
                .exitCode,
            0);
  std::vector<std::string> names = folder_.entries();
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"p.0020.exr", "p.0020.png", "p.0030.exr", "p.0030.png", "scene.json"}));
  EXPECT_FALSE(readExr(folder_.file("p.0020.exr")).pixels == readExr(folder_.file("p.0030.exr")).pixels);
}

/// Frames load ahead of their turn: each still has its own particles, warnings and errors.
TEST_F(MoteRender, FramesThatLoadAheadAreThoseRenderedAlone) {
  ASSERT_EQ(
      test::mote({"generate", "plume", "--count", "3000", "--frames", "1-3", "-o", folder_.file("p.#.prt")}).exitCode,
      0);
  writeBytes(folder_.file("p.2.prt"), readBytes(folder_.file("p.2.prt")) + "behind the end");
  writeBytes(folder_.file("p.4.prt"), "");  // its file is there, so nothing is said before its turn
  writeBytes(scene_, R"({"particles": [{"file": "p.#.prt"}], "medium": {"density_scale": 0.001},
    "camera": {"position": [0, 1, 6], "target": [0, 1, 0]}, "lights": [{"name": "key", "position": [2, 3, 1]}],
    "output": {"size": [48, 32]}})");
  const std::string stats = folder_.file("s.json");
  const ProcessResult all =
      render({"--frames", "1-4", "-o", folder_.file("all.#.exr"), "--stats", stats, "--threads", "2"});
  EXPECT_EQ(all.exitCode, 2);
  EXPECT_TRUE(contains(all.err, "p.4.prt")) << all.err;
  EXPECT_LT(all.err.find("frame 1:"), all.err.find("warning:")) << "said in its turn: " << all.err;
  EXPECT_LT(all.err.find("frame 3:"), all.err.find("p.4.prt")) << all.err;
  for (const char* threads : {"1", "2"})
    ASSERT_EQ(
        render({"--frames", "1-3", "-o", folder_.file("all.#.exr"), "--stats", stats, "--threads", threads}).exitCode,
        0);
  const json frames = json::parse(readBytes(stats))["frames"];
  for (int frame = 1; frame <= 3; ++frame) {
    EXPECT_EQ(frames[frame - 1]["warnings"].size(), frame == 2 ? 1u : 0u);
    const std::string number = std::to_string(frame), alone = folder_.file("alone." + number + ".exr");
    ASSERT_EQ(render({"--frames", number + "-" + number, "-o", alone}).exitCode, 0);
    EXPECT_TRUE(readExr(folder_.file("all." + number + ".exr")).pixels == readExr(alone).pixels);
  }
}

TEST_F(MoteRender, StatsHaveTheKeysOfTheContract) {
  const std::string ball = makeBall(folder_);
  ASSERT_EQ(render({"-o", folder_.file("out.exr"), "--stats", folder_.file("stats.json")}).exitCode, 0);
  const json stats = json::parse(readBytes(folder_.file("stats.json")));
  EXPECT_EQ(stats["version"], MOTE_VERSION);
  EXPECT_TRUE(stats.contains("device"));
  EXPECT_GE(stats["threads"], 1);
  ASSERT_EQ(stats["frames"].size(), 1u);
  const json& frame = stats["frames"][0];
  EXPECT_EQ(frame["frame"], 1);
  EXPECT_EQ(frame["particles"], 2000);
  EXPECT_EQ(frame["in_octree"], 2000);
  EXPECT_EQ(frame["drawn"], 2000);
  EXPECT_EQ(frame["lights"], 1);
  for (const char* stage : {"load", "octree", "lighting", "sort", "splat", "write", "total"}) {
    ASSERT_TRUE(frame["seconds"].contains(stage)) << stage;
    EXPECT_GE(frame["seconds"][stage], 0) << stage;
  }
  EXPECT_GT(frame["bytes"]["peak_rss"], 1'000'000) << "no process is smaller";
  EXPECT_EQ(frame["bytes"]["device"], 0);
  EXPECT_GT(frame["density_scale"], 0);
  EXPECT_GT(frame["radius"]["min"], 0);
  EXPECT_LE(frame["radius"]["mean"], frame["radius"]["max"]);
  ASSERT_EQ(frame["inputs"].size(), 1u);
  EXPECT_EQ(frame["inputs"][0]["file"], ball);
  EXPECT_EQ(frame["inputs"][0]["sha256"].get<std::string>().size(), 64u);
  EXPECT_TRUE(frame["warnings"].is_array());
}

TEST_F(MoteRender, StatsHoldTheDevicesOwnSecondsOfEachStage) {
  makeBall(folder_);
  const ProcessResult result = test::mote({"render", scene_, "--lighting", "gpu", "--raster", "gpu", "--validate", "-o",
                                           folder_.file("out.exr"), "--stats", folder_.file("stats.json")},
                                          test::kOnLavapipe);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const json stats = json::parse(readBytes(folder_.file("stats.json")));
  EXPECT_NE(stats["device"], "none");
  const json& frame = stats["frames"][0];
  for (const char* stage : {"lighting", "sort", "splat"}) {
    ASSERT_TRUE(frame["device_seconds"].contains(stage)) << stage;
    EXPECT_GT(frame["device_seconds"][stage], 0) << stage;
    // The device works within the stage as the host sees it; a millisecond for the two clocks.
    EXPECT_LE(frame["device_seconds"][stage], frame["seconds"][stage].get<double>() + 1e-3) << stage;
  }
  EXPECT_GT(frame["bytes"]["device"], 2000 * 20) << "the tree alone takes 20 bytes a particle";
}

TEST_F(MoteRender, StatsTellTheErrorOfASubsampleOnlyWhereItWasMeasured) {
  writeBytes(scene_, R"({"particles": [{"generate": "ball", "count": 3000}], "output": {"size": [32, 24]}})");
  const auto subsamples = [&](const Arguments& settings, const std::string& frames = "1-1") {
    Arguments arguments{"-o", folder_.file("out.#.exr"), "--frames", frames, "--stats", folder_.file("stats.json")};
    for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
    const ProcessResult result = render(arguments);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    json found = json::array();
    const json stats = json::parse(readBytes(folder_.file("stats.json")));
    for (const json& frame : stats["frames"]) found.push_back(frame["subsample"]);
    // The picture's header says the same.
    const json header = json::parse(exrStrings(folder_.file("out.1.exr")).at("mote:stats"));
    EXPECT_EQ(header["subsample"], found[0]);
    return found;
  };
  EXPECT_EQ(subsamples({}).dump(), R"([{"error":0.0,"fraction":1.0}])");
  const json fixed = subsamples({"/lighting/subsample=0.25", "/lighting/error=0.05"});
  EXPECT_EQ(fixed[0]["fraction"], 0.25);
  EXPECT_TRUE(fixed[0]["error"].is_null()) << "nobody measured it";
  const json measured = subsamples({R"(/lighting/subsample="auto")", "/lighting/error=0.05"}, "1-2");
  ASSERT_EQ(measured.size(), 2u);
  EXPECT_GT(measured[0]["fraction"], 0);
  EXPECT_LT(measured[0]["fraction"], 1);
  EXPECT_GT(measured[0]["error"], 0);
  EXPECT_LE(measured[0]["error"], 0.05);
  EXPECT_EQ(measured[1]["fraction"], measured[0]["fraction"]);
  EXPECT_TRUE(measured[1]["error"].is_null()) << "the second frame keeps the share and measures nothing";
}

/// ball.prt: 2,000 particles in a ball, each with the ID that `id` gives it.
template <class Id>
void writeBallWithIds(const TempFolder& folder, const Id& id) {
  std::vector<vec3> position;
  std::vector<std::uint64_t> ids;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(3, i);
    position.push_back(vec3(random.direction() * std::cbrt(random.uniform())));
    ids.push_back(id(i));
  }
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(position)),
                                       PrtColumn::of("ID", std::span<const std::uint64_t>(ids))};
  writePrt(folder.file("ball.prt"), columns);
}

TEST_F(MoteRender, GoesByTheIndexWhereTooManyParticlesShareAnId) {
  const auto frameOf = [&](const Arguments& settings) {
    Arguments arguments{"-o", folder_.file("out.exr"), "--stats", folder_.file("stats.json")};
    for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
    const ProcessResult result = render(arguments);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return json::parse(readBytes(folder_.file("stats.json")))["frames"][0];
  };
  const Arguments tenth{"/lighting/subsample=0.1"};
  writeBallWithIds(folder_, [](std::uint64_t i) { return i; });
  const json byIndex = frameOf(tenth);
  EXPECT_TRUE(byIndex["warnings"].empty()) << byIndex["warnings"];
  writeBallWithIds(folder_, [](std::uint64_t i) { return i % 1000; });  // as two sources would have it
  EXPECT_TRUE(frameOf(tenth)["warnings"].empty());
  for (const std::uint64_t ids : {1, 20}) {
    writeBallWithIds(folder_, [&](std::uint64_t i) { return 7 + i % ids; });
    const json shared = frameOf(tenth);
    EXPECT_EQ(shared["in_octree"], byIndex["in_octree"]);
    ASSERT_EQ(shared["warnings"].size(), 1u) << shared["warnings"];
    EXPECT_TRUE(contains(shared["warnings"][0], fmt::format("ID is no name of a particle: {}", 2000 / ids)));
    EXPECT_TRUE(frameOf({})["warnings"].empty()) << "all particles are in the octree: nothing is chosen";
  }
}

TEST_F(MoteRender, WarnsWhereASubsampleLeavesNothingInTheOctree) {
  makeBall(folder_);
  const ProcessResult result = render(
      {"-o", folder_.file("out.exr"), "--set", "/lighting/subsample=1e-6", "--stats", folder_.file("stats.json")});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const json frame = json::parse(readBytes(folder_.file("stats.json")))["frames"][0];
  EXPECT_EQ(frame["in_octree"], 0);
  ASSERT_EQ(frame["warnings"].size(), 1u);
  EXPECT_TRUE(contains(frame["warnings"][0], "leaves none of the 2000 particles in the octree"));
}

TEST_F(MoteRender, SecondsOfSolidsAreTheirOwnAndTheLogNamesThem) {
  makeBall(folder_);
  writeBytes(folder_.file("wall.obj"), "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
  const auto secondsOf = [&](const Arguments& settings, std::string& log) {
    Arguments arguments{"-o", folder_.file("out.exr"), "--stats", folder_.file("stats.json")};
    for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
    const ProcessResult result = render(arguments);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    log = result.err;
    return json::parse(readBytes(folder_.file("stats.json")))["frames"][0]["seconds"];
  };
  std::string log;
  EXPECT_FALSE(secondsOf({}, log).contains("solids"));
  EXPECT_FALSE(contains(log, "solids"));
  for (const char* mode : {"shaded", "hidden"}) {
    const json seconds = secondsOf({fmt::format(R"(/solids=[{{"file": "wall.obj", "mode": "{}"}}])", mode)}, log);
    ASSERT_TRUE(seconds.contains("solids")) << mode;
    EXPECT_GT(seconds["solids"], 0) << mode;
    EXPECT_TRUE(contains(log, ", solids "));
    double sum = 0;
    for (const auto& [stage, value] : seconds.items()) sum += stage == "total" ? 0 : value.get<double>();
    EXPECT_LE(sum, seconds["total"].get<double>() + 1e-5) << "no second counts twice: " << seconds;
  }
}

// ---- sprites ----

/// One particle of radius 1 at the origin before a camera 4 units away, lit by a sun from there: τ = ln 2 in its
/// middle.
constexpr const char* kSpriteScene = R"({
  "particles": [{"file": "one.prt", "radius": 1}],
  "medium": {"density_mode": "peak", "density_scale": 1, "albedo": [1, 1, 1]},
  "lights": [{"name": "sun", "type": "directional", "direction": [0, 0, -1], "irradiance": 10}],
  "camera": {"position": [0, 0, 4], "target": [0, 0, 0], "fov": 40, "near": 0.1, "far": 50},
  "output": {"size": [65, 65], "precision": "float"}
})";

TEST_F(MoteRender, SpritesColourAndFadeAParticleAsTheirPixelsSay) {
  const std::vector<vec3> position{{0, 0, 0}};
  const std::vector<float> density{std::log(2.0f)};
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(position)),
                                       PrtColumn::of("Density", std::span<const float>(density))};
  writePrt(folder_.file("one.prt"), columns);
  writeBytes(scene_, kSpriteScene);
  // One pixel each, so that the middle of the splat is that very colour. An EXR's name may be in capitals.
  writePngBytes(folder_.file("color.png"), {188, 51, 255}, 1, 1);
  writePngBytes(folder_.file("opacity.png"), {51, 51, 51}, 1, 1);
  Image color(1, 1), opacity(1, 1);
  color.pixels[0] = vec4(2, 0.25f, 0, 1), opacity.pixels[0] = vec4(0.7f, 0.7f, 0.7f, 0.4f);
  writeExr(folder_.file("COLOR.EXR"), color, {.precision = ExrPrecision::Float});
  writeExr(folder_.file("opacity.exr"), opacity, {.precision = ExrPrecision::Float});
  const double light = 0.5 * 10 / (4 * kPi);  // α · irradiance · isotropic phase, of a white particle
  struct Case {
    const char *color, *opacity;
    dvec3 factor;
    double share;
  };
  // 188, 51, 255 decoded by IEC 61966-2-1; 51 / 255 as it stands; alpha where there is any.
  const Case cases[] = {{"", "", dvec3(1), 1},
                        {"color.png", "", {0.502886, 0.033105, 1}, 1},
                        {"COLOR.EXR", "", {2, 0.25, 0}, 1},
                        {"", "opacity.png", dvec3(1), 0.2},
                        {"", "opacity.exr", dvec3(1), 0.4},
                        {"COLOR.EXR", "opacity.png", {2, 0.25, 0}, 0.2}};
  for (const char* where : {"cpu", "gpu"})
    for (const auto& [colorFile, opacityFile, factor, share] : cases) {
      const ProcessResult result =
          test::mote({"render", scene_, "--lighting", "cpu", "--raster", where, "-o", folder_.file("out.exr"), "--set",
                      fmt::format("/view/sprite_color=\"{}\"", colorFile), "--set",
                      fmt::format("/view/sprite_opacity=\"{}\"", opacityFile), "--stats", folder_.file("stats.json")},
                     test::kOnLavapipe);
      ASSERT_EQ(result.exitCode, 0) << result.err;
      const vec4 middle = readExr(folder_.file("out.exr")).at(32, 32);
      EXPECT_NEAR(middle.w, 0.5 * share, 1e-5) << where << " " << colorFile << " " << opacityFile;
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(middle[c], light * share * factor[c], 1e-5 * (1 + factor[c])) << where << " " << colorFile;
      // What a picture is made from stands in its statistics.
      const json inputs = json::parse(readBytes(folder_.file("stats.json")))["frames"][0]["inputs"];
      std::string files;
      for (const json& input : inputs) {
        files += input["file"].get<std::string>() + " ";
        EXPECT_EQ(input["sha256"].get<std::string>().size(), 64u);
      }
      EXPECT_EQ(inputs.size(), 1u + (*colorFile ? 1u : 0u) + (*opacityFile ? 1u : 0u));
      for (const char* name : {colorFile, opacityFile}) EXPECT_TRUE(contains(files, name));
    }
}

TEST_F(MoteRender, RefusesSpritesWithColoursThatAreNone) {
  makeBall(folder_);
  Image sprite(3, 2);
  for (vec4& pixel : sprite.pixels) pixel = vec4(1);
  for (const float bad : {-0.5f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    sprite.at(2, 1).y = bad;
    writeExr(folder_.file("puff.exr"), sprite, {.precision = ExrPrecision::Float});
    expectRefusal(
        folder_.file("puff.exr") + ": pixel 2, 1: expected finite colours ≥ 0, got 1, " + fmt::format("{}", bad),
        {"--set", R"(/view/sprite_color="puff.exr")"});
  }
  expectRefusal("pixel 2, 1: expected finite numbers", {"--set", R"(/view/sprite_opacity="puff.exr")"});
}

TEST_F(MoteRender, PutsCameraFrameAndStatisticsIntoTheHeader) {
  makeBall(folder_);
  ASSERT_EQ(render({"-o", folder_.file("out.exr")}).exitCode, 0);
  const std::string bytes = readBytes(folder_.file("out.exr")).substr(0, 16384);
  for (const char* attribute : {"worldToCamera", "worldToNDC", "framesPerSecond", "pixelAspectRatio"})
    EXPECT_TRUE(contains(bytes, attribute));
  bool found = false;
  const auto strings = exrStrings(folder_.file("out.exr"));
  for (const auto& [name, value] : strings)
    if (json::accept(value)) found = found || json::parse(value).dump().find("\"particles\":2000") != std::string::npos;
  EXPECT_TRUE(found) << "no attribute holds the statistics";
  EXPECT_FALSE(strings.contains("mote:Z")) << "there is no Z";
  ASSERT_EQ(render({"-o", folder_.file("z.exr"), "--set", R"(/output/aovs=["Z"])"}).exitCode, 0);
  EXPECT_TRUE(contains(exrStrings(folder_.file("z.exr")).at("mote:Z"), "distance along the view axis"));
}

TEST_F(MoteRender, WritesThePixelAspectIntoTheHeader) {
  makeBall(folder_);
  ASSERT_EQ(render({"-o", folder_.file("out.exr"), "--set", "/output/pixel_aspect=2"}).exitCode, 0);
  const std::string bytes = readBytes(folder_.file("out.exr"));
  const std::string name("pixelAspectRatio\0float\0", 23);  // then its size, 4 bytes, then the number
  const std::size_t at = bytes.find(name);
  ASSERT_NE(at, std::string::npos);
  float aspect = 0;
  std::memcpy(&aspect, bytes.data() + at + name.size() + 4, sizeof aspect);
  EXPECT_EQ(aspect, 2);
}

// ---- bad scenes ----

TEST_F(MoteRender, RefusesAMissingScene) {
  const ProcessResult result =
      test::mote({"render", folder_.file("gone.json"), "-o", folder_.file("out.exr")}, kWithoutVulkan);
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, folder_.file("gone.json")));
  EXPECT_EQ(folder_.entries().size(), 1u);
}

TEST_F(MoteRender, RefusesAMissingParticleFile) { expectRefusal(folder_.file("ball.prt")); }

TEST_F(MoteRender, RefusesAMissingSprite) {
  makeBall(folder_);
  writeBytes(folder_.file("puff.png"), "not a picture");
  expectRefusal("/view/sprite_color: expected a PNG or EXR picture, got " + folder_.file("pufff.png"),
                {"--set", R"(/view/sprite_color="pufff.png")"});
  expectRefusal("'puff.png'", {"--set", R"(/view/sprite_color="pufff.png")"});
}

TEST_F(MoteRender, RefusesASpriteThatIsNoPicture) {
  makeBall(folder_);
  writeBytes(folder_.file("puff.png"), "not a picture");
  writeBytes(folder_.file("puff.exr"), "not a picture");
  expectRefusal(folder_.file("puff.png"), {"--set", R"(/view/sprite_opacity="puff.png")"});
  expectRefusal(folder_.file("puff.exr"), {"--set", R"(/view/sprite_opacity="puff.exr")"});
}

TEST_F(MoteRender, RefusesASolidThatIsMissingOrHasNoTriangles) {
  makeBall(folder_);
  writeBytes(folder_.file("wall.obj"), "v 0 0 0\nv 1 0 0\n");
  expectRefusal(folder_.file("wal.obj") + ": expected a mesh, got no such file",
                {"--set", R"(/solids=[{"file": "wal.obj"}])"});
  expectRefusal(folder_.file("wall.obj"), {"--set", R"(/solids=[{"file": "wall.obj"}])"});
}

TEST_F(MoteRender, RefusesAnUnknownKeyWithItsLine) {
  makeBall(folder_);
  writeBytes(scene_, "{\n  \"particles\": [{\"file\": \"ball.prt\"}],\n  \"ligths\": []\n}\n");
  expectRefusal("scene.json:3:3: /ligths");
}

TEST_F(MoteRender, RefusesABadOverride) {
  makeBall(folder_);
  expectRefusal("/camera/fov", {"--set", "/camera/fov=-5"});
  expectRefusal("/camera/fog", {"--set", "/camera/fog=5"});
  expectRefusal("--set", {"--set", "nonsense"});
}

TEST_F(MoteRender, RefusesAnEmptyParticleSet) {
  const std::vector<vec3> none;
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(none))};
  writePrt(folder_.file("ball.prt"), columns);
  expectRefusal("ball.prt: expected at least one particle");
}

TEST_F(MoteRender, RefusesATruncatedParticleFile) {
  makeBall(folder_);
  const std::string bytes = readBytes(folder_.file("ball.prt"));
  writeBytes(folder_.file("ball.prt"), bytes.substr(0, bytes.size() / 2));
  expectRefusal("ball.prt: ");
}

TEST_F(MoteRender, RefusesBadFlags) {
  makeBall(folder_);
  expectRefusal("--size", {"--size", "64by48"});
  expectRefusal("--frames", {"--frames", "9-1"});
  expectRefusal("--lighting", {"--lighting", "tpu"});
  expectRefusal("--raster", {"--raster", "tpu"});
  expectRefusal("--exposure", {"--exposure", "bright"});
}

// ---- bad outputs ----

TEST_F(MoteRender, SeveralFramesNeedAPattern) {
  makeBall(folder_);
  expectRefusal("####", {"--frames", "1-2"});
  const ProcessResult preview =
      render({"--frames", "1-2", "-o", folder_.file("o.####.exr"), "--preview", folder_.file("o.png")});
  EXPECT_EQ(preview.exitCode, 2);
  EXPECT_TRUE(contains(preview.err, "####"));
}

TEST_F(MoteRender, RefusesOutputsThatCannotBeWrittenBeforeAnyWork) {
  // Four thousand million particles take more memory and time than there is: the refusal comes first.
  writeBytes(scene_, R"({"particles": [{"generate": "cloud", "count": 4000000000}]})");
  writeBytes(folder_.file("plain"), "a file");
  const std::string good = folder_.file("out.exr");
  const std::pair<Arguments, std::string> cases[] = {
      {{"-o", folder_.file("missing/out.exr")}, "does not exist"},
      {{"-o", folder_.file("plain/out.exr")}, "is not a folder"},
      {{"-o", folder_.path()}, "folder"},
      {{"-o", "/proc/out.exr"}, "cannot write there"},
      {{"-o", good, "--preview", folder_.file("missing/out.png")}, "does not exist"},
      {{"-o", good, "--stats", folder_.file("missing/stats.json")}, "does not exist"},
  };
  for (const auto& [arguments, message] : cases) {
    const ProcessResult result = render(arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments.back();
    EXPECT_TRUE(contains(result.err, message));
  }
  EXPECT_EQ(folder_.entries().size(), 2u) << "scene and plain file only";
}

TEST_F(MoteRender, AFullDiskIsExitCode3AndLeavesTheOldPicture) {
  makeBall(folder_);
  writeBytes(folder_.file("out.exr"), "old");
  ProcessOptions full = kWithoutVulkan;
  full.largestFile = 2048;  // less than the 64 × 48 picture of noise-like values takes
  const ProcessResult result = render({"--set", "/output/compression=none", "-o", folder_.file("out.exr")}, full);
  EXPECT_EQ(result.exitCode, 3) << result.err;
  EXPECT_TRUE(contains(result.err, "out.exr"));
  EXPECT_EQ(readBytes(folder_.file("out.exr")), "old");
  EXPECT_EQ(folder_.entries().size(), 3u) << "scene, particles and the old picture";
}

TEST_F(MoteRender, AFullDiskForPreviewAndStatsIsExitCode3Too) {
  makeBall(folder_);
  ProcessOptions full = kWithoutVulkan;
  full.largestFile = 64;
  const ProcessResult result = render({"-o", folder_.file("out.exr"), "--stats", folder_.file("stats.json")}, full);
  EXPECT_EQ(result.exitCode, 3) << result.err;
  EXPECT_EQ(folder_.entries().size(), 2u) << "scene and particles";
}

TEST_F(MoteRender, ASignalIsExitCode130AndLeavesOnlyWholePictures) {
  makeBall(folder_);
  ProcessOptions interrupted = kWithoutVulkan;
  interrupted.signalWhen = [&] { return std::filesystem::exists(folder_.file("o.1.exr")); };
  const ProcessResult result = render({"--frames", "1-999999", "-o", folder_.file("o.#.exr")}, interrupted);
  EXPECT_EQ(result.exitCode, 130);
  for (const std::string& name : folder_.entries()) {
    EXPECT_FALSE(name.starts_with('.')) << name;
    if (name.ends_with(".exr")) {
      EXPECT_EQ(readExr(folder_.file(name)).width, 64);
    }
  }
}

}  // namespace
}  // namespace mote
