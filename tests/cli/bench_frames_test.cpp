// mote bench figures and mote bench frame, which draw whole frames: tiny ones, for what is drawn, checked and reported.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Json = nlohmann::json;

constexpr int kRuns = 2;
const std::set<std::string> kOnHost{"octree", "lighting", "sort", "splat"};
const std::set<std::string> kOnDevice{"octree",          "lighting",    "sort",        "splat",
                                      "device_lighting", "device_sort", "device_splat"};

/// With the validation layers, any message of which is a failure.
ProcessResult bench(const std::string& which, const std::string& count, const std::string& report,
                    const ProcessOptions& options) {
  return mote({"bench", which, "--count", count, "--runs", std::to_string(kRuns), "--report", report, "--validate"},
              options);
}

Json runsOf(const std::string& report) { return Json::parse(readBytes(report))["runs"]; }

std::set<std::string> with(std::set<std::string> names, std::initializer_list<const char*> more) {
  names.insert(more.begin(), more.end());
  return names;
}

/// Seconds of every run, and of exactly these stages, which together take no longer than the run.
void expectStages(const Json& seconds, const Json& stages, const std::set<std::string>& names) {
  ASSERT_EQ(seconds.size(), kRuns);
  ASSERT_EQ(stages.size(), names.size()) << stages;
  for (int run = 0; run < kRuns; ++run) {
    double sum = 0;
    for (const std::string& name : names) {
      ASSERT_EQ(stages[name].size(), kRuns) << name;
      EXPECT_GT(stages[name][run].get<double>(), 0) << name;
      if (!name.starts_with("device_")) sum += stages[name][run].get<double>();
    }
    EXPECT_LE(sum, seconds[run].get<double>());
  }
}

void expectBoth(const Json& run, std::initializer_list<const char*> more = {}) {
  SCOPED_TRACE(run["name"].get<std::string>());
  EXPECT_EQ(run["check"]["passed"], true) << run["check"];
  EXPECT_TRUE(contains(run["check"]["text"].get<std::string>(), "pictures differ by RMSE"));
  EXPECT_TRUE(contains(run["check"]["text"].get<std::string>(), "the picture's RMS is"));
  EXPECT_EQ(run["a"], "CPU");
  EXPECT_TRUE(run["b"].get<std::string>().starts_with("device")) << run["b"];
  expectStages(run["seconds_a"], run["stages_a"], with(kOnHost, more));
  expectStages(run["seconds_b"], run["stages_b"], with(kOnDevice, more));
}

void expectHostAlone(const Json& run, std::initializer_list<const char*> more = {}) {
  SCOPED_TRACE(run["name"].get<std::string>());
  EXPECT_EQ(run["check"]["passed"], true) << run["check"];
  EXPECT_TRUE(contains(run["check"]["text"].get<std::string>(), "the picture's RMS is"));
  expectStages(run["seconds_a"], run["stages_a"], with(kOnHost, more));
  EXPECT_EQ(run["seconds_b"].size(), 0u);
  EXPECT_TRUE(run["b"].is_null() && !run.contains("stages_b")) << run;
}

using Points = std::vector<std::pair<double, int>>;  ///< x and the particles there

/// The thesis' figures with a thousandth of its particles and pixels.
const std::map<int, Points> kThousandth{
    {22, {{125, 125}, {250, 250}, {500, 500}, {1000, 1000}, {2000, 2000}, {4000, 4000}}},
    {23, {{1, 250}, {2, 250}, {4, 250}, {8, 250}, {16, 250}}},
    {24, {{20 * 11, 250}, {30 * 17, 250}, {40 * 23, 250}, {61 * 34, 250}, {81 * 46, 250}, {121 * 68, 250}}},
    {25, {{10, 1000}, {25, 1000}, {50, 1000}, {100, 1000}, {250, 1000}, {500, 1000}, {1000, 1000}}},
    {31, {{100, 3000}, {50, 3000}, {10, 3000}}}};

std::map<int, Points> pointsOf(const Json& runs) {
  std::map<int, Points> points;
  for (const Json& run : runs) points[run["figure"]["number"]].emplace_back(run["figure"]["x"], run["count"]);
  return points;
}

TEST(BenchFigures, DrawsEveryPointOnBothBackendsAndTimesItsStages) {
  const TempFolder folder;
  const ProcessResult result = bench("figures", "4000", folder.file("report.json"), kOnLavapipe);
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
  const Json runs = runsOf(folder.file("report.json"));
  EXPECT_EQ(pointsOf(runs), kThousandth);
  for (const Json& run : runs) expectBoth(run);
  for (const char* words : {"figure 22, 125 particles, 125 particles", "figure 23, 16 lights", "figure 24, 121 × 68",
                            "figure 25, 50 particles per cell", "figure 31, 10 % in the octree"})
    EXPECT_TRUE(contains(result.out, words));
}

TEST(BenchFigures, LeavesTheDeviceOutWhereThereIsNone) {
  const TempFolder folder;
  const ProcessResult result = bench("figures", "4000", folder.file("report.json"), kWithoutVulkan);
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
  const Json runs = runsOf(folder.file("report.json"));
  EXPECT_EQ(pointsOf(runs), kThousandth);
  for (const Json& run : runs) expectHostAlone(run);
}

ProcessOptions inTemporaryFolder(ProcessOptions options, const std::string& path) {
  options.environment["TMPDIR"] = path;
  return options;
}

TEST(BenchFrame, GoesFromFileToPictureOnBothBackends) {
  const TempFolder folder, temporary;
  const ProcessResult result =
      bench("frame", "9000", folder.file("report.json"), inTemporaryFolder(kOnLavapipe, temporary.path()));
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
  EXPECT_TRUE(temporary.entries().empty());
  const Json root = Json::parse(readBytes(folder.file("report.json")));
  const Json& runs = root["runs"];
  ASSERT_EQ(runs.size(), 4u);
  for (const Json& run : runs) expectBoth(run, {"load", "write"});
  EXPECT_EQ(runs[0]["count"], 9000);
  EXPECT_TRUE(contains(runs[0]["name"].get<std::string>(), "61 × 34, error 0.01"));
  EXPECT_TRUE(contains(runs[0]["check"]["text"].get<std::string>(), "mean |ΔT|"));
  const char* shares[] = {"100 % in the octree (thesis, 3 M: 10.4 s)", "50 % in the octree (thesis, 3 M: 5.5 s)",
                          "10 % in the octree (thesis, 3 M: 3.5 s)"};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(runs[i + 1]["count"], 3000);
    EXPECT_TRUE(contains(runs[i + 1]["name"].get<std::string>(), shares[i]));
  }
  ASSERT_EQ(root["floors"].size(), 2u);
  const char* sides[] = {"seconds_a", "seconds_b"};
  const double limits[] = {7.1, 15};
  for (int side = 0; side < 2; ++side) {
    const auto seconds = runs[0][sides[side]].get<std::vector<double>>();
    EXPECT_DOUBLE_EQ(root["floors"][side]["value"].get<double>(), (seconds[0] + seconds[1]) / 2);
    EXPECT_EQ(root["floors"][side]["limit"], limits[side]);
  }
}

TEST(BenchFrame, LeavesTheDeviceOutWhereThereIsNone) {
  const TempFolder folder, temporary;
  const ProcessResult result =
      bench("frame", "9000", folder.file("report.json"), inTemporaryFolder(kWithoutVulkan, temporary.path()));
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
  const Json root = Json::parse(readBytes(folder.file("report.json")));
  ASSERT_EQ(root["runs"].size(), 4u);
  for (const Json& run : root["runs"]) expectHostAlone(run, {"load", "write"});
  EXPECT_TRUE(contains(root["runs"][0]["check"]["text"].get<std::string>(), "mean |ΔT|"));
  EXPECT_EQ(root["floors"].size(), 1u);
}

TEST(BenchFrame, SaysThatThereIsNoTemporaryFolder) {
  const TempFolder folder;
  const ProcessResult result =
      bench("frame", "9000", folder.file("report.json"), inTemporaryFolder(kWithoutVulkan, folder.file("missing")));
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_TRUE(contains(result.err, "TMPDIR"));
  EXPECT_TRUE(folder.entries().empty());
}

}  // namespace
}  // namespace mote::test
