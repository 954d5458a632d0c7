// mote render of several frames: where some fail the others are as if nothing had been, and each is what it is alone.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Json = nlohmann::json;

/// Four frames of smoke, the second of which is cut off.
class MoteRenderBatch : public testing::Test {
 protected:
  MoteRenderBatch() {
    EXPECT_EQ(mote({"generate", "plume", "--count", "2000", "--frames", "1-4", "-o", folder_.file("p.#.prt")}).exitCode,
              0);
    whole_ = readBytes(damaged_);
    writeBytes(damaged_, whole_.substr(0, whole_.size() / 2));
    writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "p.#.prt"}], "output": {"size": [48, 32]},
      "medium": {"density_scale": 0.001}, "camera": {"position": [0, 1, 6], "target": [0, 1, 0]},
      "lights": [{"name": "key", "position": [2, 3, 1]}]})");
  }

  ProcessResult render(const std::string& pictures, std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments{"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu"};
    more.insert(more.end(), {"--frames", "1-4", "-o", folder_.file(pictures), "--stats", folder_.file("stats.json")});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return mote(arguments, kWithoutVulkan);
  }
  bool exists(const std::string& name) const { return std::filesystem::exists(folder_.file(name)); }

  TempFolder folder_;
  const std::string damaged_ = folder_.file("p.2.prt");
  std::string whole_;
};

TEST_F(MoteRenderBatch, GoesOnBehindAFrameThatFails) {
  const ProcessResult result = render("some.#.exr");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, "mote: frame 2: " + damaged_));
  EXPECT_TRUE(contains(result.err, "mote: 1 of 4 frames failed:\n            1  written\n            2  " + damaged_));
  EXPECT_TRUE(contains(result.err, "\n          3-4  written\n"));
  EXPECT_FALSE(exists("some.2.exr"));

  const Json stats = Json::parse(readBytes(folder_.file("stats.json")));
  EXPECT_EQ(stats["frames"].size(), 3u);
  ASSERT_EQ(stats["failed"].size(), 1u);
  EXPECT_EQ(stats["failed"][0]["frame"], 2);
  EXPECT_TRUE(contains(stats["failed"][0]["error"].get<std::string>(), "cut off"));

  writeBytes(damaged_, whole_);
  ASSERT_EQ(render("all.#.exr").exitCode, 0);
  EXPECT_TRUE(Json::parse(readBytes(folder_.file("stats.json")))["failed"].empty());
  for (const std::string frame : {"1", "3", "4"})
    EXPECT_TRUE(readExr(folder_.file("some." + frame + ".exr")).pixels ==
                readExr(folder_.file("all." + frame + ".exr")).pixels)
        << frame;
}

TEST_F(MoteRenderBatch, StopsAtTheFirstThatFailsWhereAsked) {
  const ProcessResult result = render("some.#.exr", {"--stop-on-error"});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, damaged_));
  EXPECT_FALSE(contains(result.err, "frames failed"));
  EXPECT_TRUE(exists("some.1.exr"));
  EXPECT_FALSE(exists("some.2.exr") || exists("some.3.exr") || exists("some.4.exr"));
}

TEST_F(MoteRenderBatch, SaysOfItsOnlyFrameWhatIsWrongAndNoMore) {
  const ProcessResult alone = mote({"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu",
                                    "--frames", "2-2", "-o", folder_.file("alone.exr")},
                                   kWithoutVulkan);
  EXPECT_EQ(alone.exitCode, 2);
  EXPECT_TRUE(contains(alone.err, "\nmote: " + damaged_));
  EXPECT_FALSE(contains(alone.err, "frames failed"));
}

TEST_F(MoteRenderBatch, TheMachinesFailuresWeighMoreThanTheInputs) {
  ProcessOptions full = kWithoutVulkan;
  full.largestFile = 1024;  // less than a picture
  const ProcessResult result = mote({"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu",
                                     "--frames", "1-3", "-o", folder_.file("some.#.exr")},
                                    full);
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_TRUE(contains(result.err, "mote: 3 of 3 frames failed:"));
  EXPECT_TRUE(contains(result.err, "\n            2  " + damaged_));
  EXPECT_FALSE(exists("some.1.exr"));
}

TEST_F(MoteRenderBatch, ResumesWhereFramesAreMissingOrNotWhatTheyWere) {
  writeBytes(damaged_, whole_);
  // The scene leaves the camera, the density and the light open: the first frame settles them.
  writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "p.#.prt"}], "output": {"size": [48, 32]}})");
  const auto resumed = [&](std::vector<std::string> more = {}) {
    more.insert(more.begin(), "--resume");
    const ProcessResult result = render("p.#.exr", more);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return Json::parse(readBytes(folder_.file("stats.json")))["skipped"].get<std::vector<int>>();
  };
  using Frames = std::vector<int>;
  ASSERT_EQ(render("p.#.exr").exitCode, 0);
  std::vector<std::string> first;
  for (const std::string frame : {"1", "2", "3", "4"}) first.push_back(readBytes(folder_.file("p." + frame + ".exr")));
  EXPECT_EQ(resumed(), (Frames{1, 2, 3, 4}));

  std::filesystem::remove(folder_.file("p.2.exr"));
  const std::string third = folder_.file("p.3.exr");
  writeBytes(third, first[2].substr(0, first[2].size() / 2));
  EXPECT_EQ(resumed(), (Frames{1, 4}));
  for (const int frame : {1, 2, 3, 4})
    EXPECT_EQ(readBytes(folder_.file("p." + std::to_string(frame) + ".exr")), first[frame - 1]) << frame;

  // Another file, the same settings.
  ASSERT_EQ(mote({"generate", "plume", "--count", "2000", "--seed", "7", "-o", folder_.file("p.4.prt")}).exitCode, 0);
  EXPECT_EQ(resumed(), (Frames{1, 2, 3}));
  EXPECT_NE(readBytes(folder_.file("p.4.exr")), first[3]);
  // The same scene in other words, other settings, another size.
  writeBytes(folder_.file("scene.json"),
             R"({ /* small */ "output": {"size": [48.0, 32]}, "particles": [{"file": "p.#.prt"}]})");
  EXPECT_EQ(resumed(), (Frames{1, 2, 3, 4}));
  EXPECT_EQ(resumed({"--set", "/medium/optical_depth=3"}), Frames{});
  EXPECT_EQ(resumed({"--size", "32x32"}), Frames{});
  EXPECT_EQ(resumed({"--size", "32x32"}), (Frames{1, 2, 3, 4}));
  // A preview that is wanted and not there.
  EXPECT_EQ(resumed({"--size", "32x32", "--preview", folder_.file("p.#.png")}), Frames{});
}

/// Camera, light and density are open: the shot's first frame settles them, whatever part of it a run draws.
TEST_F(MoteRenderBatch, AFrameAloneIsWhatItIsAmongAll) {
  writeBytes(damaged_, whole_);
  writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "p.#.prt"}], "output": {"size": [48, 32]},
    "frames": {"first": 1, "last": 4}})");
  const auto bytes = [&](const std::string& name) { return readBytes(folder_.file(name)); };
  const auto expectSame = [&](const std::string& frames, std::vector<int> numbers) {
    EXPECT_EQ(mote({"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu", "--frames", frames,
                    "-o", folder_.file("part.#.exr")},
                   kWithoutVulkan)
                  .exitCode,
              0);
    for (const int n : numbers)
      EXPECT_TRUE(bytes(fmt::format("part.{}.exr", n)) == bytes(fmt::format("all.{}.exr", n))) << n << " of " << frames;
  };
  ASSERT_EQ(render("all.#.exr").exitCode, 0);
  expectSame("3", {3});
  expectSame("2-4x2", {2, 4});
  const std::string third = bytes("all.3.exr");

  // The first cannot be read: all of them go by the second.
  const std::string first = readBytes(folder_.file("p.1.prt"));
  writeBytes(folder_.file("p.1.prt"), first.substr(0, first.size() / 2));
  ASSERT_EQ(render("all.#.exr").exitCode, 2);
  EXPECT_FALSE(bytes("all.3.exr") == third);
  expectSame("3", {3});
  EXPECT_EQ(Json::parse(readBytes(folder_.file("stats.json")))["frames"][0]["settled_by"], 2);
  // It can be again: what went by the second is not what it would be now.
  writeBytes(folder_.file("p.1.prt"), first);
  ASSERT_EQ(render("all.#.exr", {"--resume"}).exitCode, 0);
  EXPECT_EQ(Json::parse(readBytes(folder_.file("stats.json")))["skipped"], Json({1}));  // from before
  EXPECT_TRUE(bytes("all.3.exr") == third);
}

TEST_F(MoteRenderBatch, FarFromTheOriginTooAFrameAloneIsWhatItIsAmongAll) {
  // Everything is given but the origin, and the smoke moves: each frame by itself would be measured from elsewhere.
  writeBytes(damaged_, whole_);
  writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "p.#.prt", "translate": [1e6, 0, 0]},
      {"file": "q.#.csv"}], "output": {"size": [48, 32]},
    "medium": {"density_scale": 0.001}, "camera": {"position": [1000000, 1, 6], "target": [1000000, 1, 0]},
    "lights": [{"name": "key", "position": [1000002, 3, 1]}], "frames": {"first": 1, "last": 4}})");
  for (const int frame : {1, 2, 3, 4})
    writeBytes(folder_.file(fmt::format("q.{}.csv", frame)),
               fmt::format("x,y,z,radius,density\n{},0,0,0.1,1\n", 1000000 + 40 * (frame - 1)));
  ASSERT_EQ(render("all.#.exr").exitCode, 0);
  ASSERT_EQ(mote({"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu", "--frames", "4", "-o",
                  folder_.file("part.#.exr")},
                 kWithoutVulkan)
                .exitCode,
            0);
  EXPECT_TRUE(readBytes(folder_.file("part.4.exr")) == readBytes(folder_.file("all.4.exr")));
}

/// `mote light` too goes by the shot.
TEST_F(MoteRenderBatch, LightIsThatOfTheShot) {
  writeBytes(damaged_, whole_);
  const auto lit = [&](const std::string& frames) {
    writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "p.#.prt"}],
      "lights": [{"name": "key", "position": [2, 3, 1]}], "frames": )" + frames + "}");
    EXPECT_EQ(mote({"light", folder_.file("scene.json"), "--frame", "3", "-o", folder_.file("lit.prt")}, kWithoutVulkan)
                  .exitCode,
              0);
    return readBytes(folder_.file("lit.prt"));
  };
  const std::string ofAll = lit(R"({"first": 1, "last": 4})");
  EXPECT_FALSE(ofAll == lit(R"({"first": 3, "last": 4})"));
  EXPECT_TRUE(ofAll == lit(R"({"first": 1, "last": 4, "step": 2})"));
}

}  // namespace
}  // namespace mote::test
