// mote render from the outside: what it writes, what it refuses before any work, and what it leaves behind.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "host/particles/prt_writer.h"
#include "tests/cli/mote_program.h"

namespace mote {
namespace {

using nlohmann::json;
using test::contains;
using test::kWithoutVulkan;
using test::makeBall;
using test::ProcessOptions;
using test::ProcessResult;
using test::readBytes;
using test::TempFolder;
using test::writeBytes;
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
