// mote render --dry-run and mote info SCENE: what a run will take and what is wrong with it; --memory-limit.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Json = nlohmann::json;

class MotePreflight : public testing::Test {
 protected:
  /// Four particles that move 0.1 radii a frame, lit and in the picture; `columns` stand for those of the first row.
  void writeScene(const std::string& more = R"("lights": [{"name": "key", "position": [2, 3, 1]}])",
                  const std::string& radius = "0.2", const std::string& velocity = "0.5") const {
    std::string table = "x,y,z,radius,density,vx,vy,vz\n";
    for (const char* place : {"0,0,0", "1,0,0", "0,1,0", "0,0,1"})
      table += fmt::format("{},{},1,{},0,0\n", place, radius, velocity);
    writeBytes(folder_.file("p.csv"), table);
    writeBytes(folder_.file("scene.json"),
               R"({"particles": [{"file": "p.csv"}], "output": {"size": [64, 48], "file": "o.exr"}, )" + more + "}");
  }
  ProcessResult dryRun(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"render", folder_.file("scene.json"), "--dry-run", "--lighting", "cpu", "--raster", "cpu"});
    return mote(more, kWithoutVulkan);
  }
  std::vector<std::string> suspicions() const {
    const ProcessResult result = dryRun({"--json"});
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return Json::parse(result.out)["suspicious"].get<std::vector<std::string>>();
  }
  void expectSuspicious(const std::vector<std::string>& words) const {
    const std::vector<std::string> found = suspicions();
    ASSERT_EQ(found.size(), 1u) << testing::PrintToString(found);
    for (const std::string& word : words) EXPECT_TRUE(contains(found[0], word)) << word << " is not in: " << found[0];
  }

  TempFolder folder_;
};

TEST_F(MotePreflight, SaysWhatARunTakesAndWritesNothing) {
  writeScene();
  const ProcessResult json = dryRun({"--json"}), text = dryRun(),
                      info = mote({"info", folder_.file("scene.json"), "--json"}, kWithoutVulkan);
  ASSERT_EQ(json.exitCode, 0) << json.err;
  EXPECT_EQ(text.exitCode, 0);
  EXPECT_EQ(info.exitCode, 0);
  for (const ProcessResult& result : {json, info}) {
    const Json found = Json::parse(result.out);
    EXPECT_EQ(found["particles"], 4);
    EXPECT_EQ(found["estimate"]["rays"], 4);
    EXPECT_GT(found["estimate"]["host_bytes"], 1e6);
    EXPECT_EQ(found["estimate"]["lighting"], "cpu");
    for (const char* stage : {"load", "octree", "lighting", "draw", "write", "frame", "all"})
      EXPECT_GE(found["estimate"]["seconds"][stage], 0) << stage;
    EXPECT_GT(found["estimate"]["seconds"]["frame"], 0);
    EXPECT_EQ(found["missing"], Json::array());
    EXPECT_EQ(found["suspicious"], Json::array());
  }
  EXPECT_TRUE(contains(text.out, "  time         about "));
  EXPECT_FALSE(contains(text.out, "suspicious"));
  EXPECT_FALSE(std::filesystem::exists(folder_.file("o.exr")));
}

TEST_F(MotePreflight, MeasuresTheLargestFrameAndCountsTheOthersByTheirSize) {
  for (const auto& [frame, count] : {std::pair("1", "1000"), std::pair("2", "20000"), std::pair("3", "1000")})
    ASSERT_EQ(mote({"generate", "ball", "--count", count, "-o", folder_.file(std::string("b.") + frame + ".prt")})
                  .exitCode,
              0);
  writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "b.#.prt"}], "output": {"size": [64, 48]}})");
  const ProcessResult result = dryRun({"--json", "--frames", "1-3", "-o", folder_.file("o.#.exr")});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const Json found = Json::parse(result.out);
  EXPECT_EQ(found["particles"], 20000);
  EXPECT_EQ(found["estimate"]["measured_frame"], 2);
  const Json& seconds = found["estimate"]["seconds"];
  EXPECT_GT(seconds["all"], seconds["frame"]);
}

TEST_F(MotePreflight, NamesAllThatIsMissing) {
  writeScene(R"("solids": [{"file": "wall.obj"}], "frames": {"first": 1, "last": 5}, "view": {"sprite_color": "s.png"})");
  writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "q.#.csv"}, {"file": "r.csv"}],
    "solids": [{"file": "wall.obj"}], "frames": {"first": 1, "last": 5}, "view": {"sprite_color": "s.png"},
    "output": {"file": "o.#.exr"}})");
  for (const char* there : {"q.1.csv", "q.4.csv"}) writeBytes(folder_.file(there), "1,2,3\n");
  for (const ProcessResult& result : {dryRun(), mote({"info", folder_.file("scene.json")}, kWithoutVulkan)}) {
    EXPECT_EQ(result.exitCode, 2);
    for (const std::string& stream : {result.out, result.err})
      for (const char* words : {"got none for frames 2-3, 5", "r.csv: expected a particle file", "wall.obj", "s.png"})
        EXPECT_TRUE(contains(stream, words)) << words << " is not in:\n" << stream;
  }
  const Json found = Json::parse(dryRun({"--json"}).out);
  EXPECT_EQ(found["missing"].size(), 4u);
}

TEST_F(MotePreflight, SuspectsWhatIsSeldomMeant) {
  const std::string lights = R"("lights": [{"name": "key", "position": [2, 3, 1]}])";
  writeScene(lights, "0.2", "960");
  expectSuspicious({"by 200 of their radii", "velocity_per"});
  writeScene(lights, "20");
  expectSuspicious({"mean radius, 20", "box of all particles, 1.73"});
  writeScene(lights + R"(, "medium": {"density_scale": 1e-6})");
  expectSuspicious({"too thin to be seen", "density_scale, 1e-06"});
  writeScene(lights + R"(, "medium": {"density_scale": 1e9})");
  expectSuspicious({"nothing but their surface"});
  writeScene(lights + R"(, "camera": {"position": [0, 0, 9], "target": [0, 0, 10]})");
  expectSuspicious({"sees none of the 4 particles in frame 1"});
  writeScene(R"("lights": [])");
  expectSuspicious({"there is no light"});
}

TEST_F(MotePreflight, AMemoryLimitIsKeptOrRefusedBeforeAnyWork) {
  for (const char* frame : {"1", "2"})
    ASSERT_EQ(mote({"generate", "ball", "--count", "200000", "-o", folder_.file(std::string("b.") + frame + ".prt")})
                  .exitCode,
              0);
  writeBytes(folder_.file("scene.json"), R"({"particles": [{"file": "b.#.prt", "radius": 0.01}],
    "output": {"size": [64, 48]}, "camera": {"position": [0, 0, 5], "target": [0, 0, 0]}, "lights": []})");
  const auto render = [&](const std::string& limit) {
    return mote({"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu", "--frames", "1-2",
                 "--threads", "2", "-o", folder_.file("o.#.exr"), "--memory-limit", limit},
                kWithoutVulkan);
  };
  const ProcessResult refused = render("60M");
  EXPECT_EQ(refused.exitCode, 3);
  EXPECT_TRUE(contains(refused.err, "200000 particles and a picture of 64 × 48 take about "));
  EXPECT_TRUE(contains(refused.err, "--memory-limit is 62.9 MB"));
  EXPECT_FALSE(std::filesystem::exists(folder_.file("o.1.exr")));

  const double alone = Json::parse(mote({"info", folder_.file("scene.json"), "--no-measure", "--json"}).out)["estimate"]
                                  ["host_bytes"];
  const ProcessResult onByOne = render(fmt::format("{:.0f}", alone + 1e5));
  EXPECT_EQ(onByOne.exitCode, 0) << onByOne.err;
  EXPECT_TRUE(contains(onByOne.err, "frames load one by one"));
  const ProcessResult roomy = render("1G");
  EXPECT_EQ(roomy.exitCode, 0) << roomy.err;
  EXPECT_FALSE(contains(roomy.err, "one by one"));
  EXPECT_EQ(render("lots").exitCode, 2);
}

}  // namespace
}  // namespace mote::test
