// mote bench: tiny runs of each, for what it checks, prints and reports; how fast anything is, no test says.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Json = nlohmann::json;

constexpr int kRuns = 4;  // even: the median lies between two of them

ProcessResult bench(const std::string& which, const std::string& report, const ProcessOptions& options) {
  return mote({"bench", which, "--count", "3000", "--runs", std::to_string(kRuns), "--report", report}, options);
}

Json readJson(const std::string& path) { return Json::parse(readBytes(path)); }

double middle(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[kRuns / 2 - 1] + values[kRuns / 2]);
}

/// A comparison with both halves: as many seconds of each as runs, and ratios that follow from them.
void expectBothTimed(const Json& run) {
  const auto a = run["seconds_a"].get<std::vector<double>>(), b = run["seconds_b"].get<std::vector<double>>();
  ASSERT_EQ(a.size(), kRuns) << run;
  ASSERT_EQ(b.size(), kRuns) << run;
  std::vector<double> ratios;
  for (int i = 0; i < kRuns; ++i) {
    EXPECT_GT(a[i], 0) << run;
    ratios.push_back(b[i] / a[i]);
  }
  EXPECT_DOUBLE_EQ(run["ratio_median"].get<double>(), middle(ratios)) << run;
  EXPECT_DOUBLE_EQ(run["ratio_min"].get<double>(), *std::min_element(ratios.begin(), ratios.end())) << run;
  EXPECT_DOUBLE_EQ(run["ratio_max"].get<double>(), *std::max_element(ratios.begin(), ratios.end())) << run;
  EXPECT_EQ(run["core_seconds_a"].size(), kRuns) << run;
  EXPECT_EQ(run["core_seconds_b"].size(), kRuns) << run;
  EXPECT_TRUE(run["b"].is_string()) << run;
}

TEST(BenchCommand, TimesBothHalvesOfEachBenchmarkAndReportsThem) {
  const TempFolder folder;
  const std::string report = folder.file("report.json");
  const std::vector<std::pair<std::string, std::size_t>> comparisons{{"lighting", 6}, {"sort", 1}, {"splat", 1}};
  for (const auto& [which, count] : comparisons) {
    SCOPED_TRACE(which);
    const ProcessResult result = bench(which, report, kOnLavapipe);
    ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
    EXPECT_EQ(result.err, "");
    EXPECT_TRUE(contains(result.out, "device: llvmpipe"));
    EXPECT_TRUE(contains(result.out, "B / A"));

    const Json root = readJson(report);
    EXPECT_TRUE(contains(root["device"].get<std::string>(), "llvmpipe"));
    EXPECT_GE(root["threads"].get<int>(), 1);
    ASSERT_EQ(root["runs"].size(), count);
    for (const Json& run : root["runs"]) {
      EXPECT_EQ(run["count"], 3000);
      EXPECT_EQ(run["check"]["passed"], true) << run;
      expectBothTimed(run);
    }
  }
}

TEST(BenchCommand, HoldsTheFiguresAgainstTheFloors) {
  const TempFolder folder;
  const ProcessResult result = bench("lighting", folder.file("report.json"), kOnLavapipe);
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
  EXPECT_TRUE(contains(result.out, "floors, for 1000000 on 2 cores; this was 3000"));
  const Json root = readJson(folder.file("report.json"));
  ASSERT_EQ(root["floors"].size(), 7u);
  for (const Json& floor : root["floors"]) {
    const double value = floor["value"], limit = floor["limit"];
    EXPECT_EQ(floor["reached"], floor["wanted"] == "at least" ? value >= limit : value <= limit) << floor;
  }
  const Json &build = root["runs"][0], &equal = root["runs"][1], &varying = root["runs"][2],
             &lighting = root["runs"][3];
  EXPECT_DOUBLE_EQ(root["floors"][0]["value"].get<double>(), middle(build["seconds_b"]) / 3000 * 1e6);
  EXPECT_EQ(root["floors"][1]["value"], equal["ratio_median"]);
  EXPECT_EQ(root["floors"][2]["value"], varying["ratio_median"]);
  EXPECT_DOUBLE_EQ(root["floors"][3]["value"].get<double>(), 3000 / middle(lighting["seconds_a"]) * 1e-6);
  EXPECT_EQ(root["floors"][4]["value"], lighting["ratio_median"]);
  for (std::size_t grid : {4u, 5u}) {  // by CPU time
    std::vector<double> ratios;
    for (std::size_t k = 0; k < kRuns; ++k)
      ratios.push_back(root["runs"][grid]["core_seconds_b"][k].get<double>() /
                       root["runs"][grid]["core_seconds_a"][k].get<double>());
    EXPECT_DOUBLE_EQ(root["floors"][grid + 1]["value"].get<double>(), middle(ratios));
  }
}

/// Seconds a particle, relative to the smallest cloud's.
double relativeTime(const Json& run) {
  return run["ratio_median"].get<double>() * run["count_a"].get<double>() / run["count"].get<double>();
}

TEST(BenchCommand, ScalingHoldsEveryCloudAgainstTheSmallest) {
  const TempFolder folder;
  const std::string report = folder.file("report.json");
  const ProcessResult result = mote(
      {"bench", "scaling", "--count", "6400", "--runs", std::to_string(kRuns), "--report", report}, kWithoutVulkan);
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
  const Json root = readJson(report);
  ASSERT_EQ(root["runs"].size(), 18u);  // six doublings of tree, exact sums and an error of 0.01
  std::map<std::string, std::vector<double>> relative;
  for (std::size_t i = 0; i < 18; ++i) {
    const Json& run = root["runs"][i];
    EXPECT_EQ(run["check"]["passed"], true) << run;
    EXPECT_EQ(run["count_a"], 100);
    EXPECT_EQ(run["count"], 200 << i / 3) << run;
    expectBothTimed(run);
    auto [place, first] = relative.try_emplace(run["b"], std::vector<double>{1});
    place->second.push_back(relativeTime(run));
  }
  ASSERT_EQ(root["floors"].size(), 2u);
  const std::vector<std::string> floors{"exact lighting", "lighting, error 0.01"};
  for (std::size_t f = 0; f < 2; ++f) {
    const std::vector<double>& times = relative.at(floors[f]);
    double rise = 0;
    for (std::size_t i = 0; i < times.size(); ++i)
      for (std::size_t j = i; j < times.size(); ++j) rise = std::max(rise, times[j] / times[i]);
    EXPECT_DOUBLE_EQ(root["floors"][f]["value"].get<double>(), rise);
    EXPECT_EQ(root["floors"][f]["limit"], 1.3);
  }
}

TEST(BenchCommand, FormatsAreHeldAgainstBareNumbers) {
  const TempFolder folder;
  const std::string report = folder.file("report.json"), csv = folder.file("more.csv");
  writeBytes(csv, "x,y,z,Density\n1,2,3,0.5\n4,5,6,0.25\n");
  const ProcessResult result =
      mote({"bench", "formats", csv, "--count", "3000", "--runs", std::to_string(kRuns), "--report", report},
           kWithoutVulkan);
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
  const Json root = readJson(report);
  ASSERT_EQ(root["runs"].size(), 7u + 7u + 1u);  // written, read, and the file that was named
  for (const Json& run : root["runs"]) {
    EXPECT_EQ(run["check"]["passed"], true) << run;
    EXPECT_EQ(run["unit"], "bytes of numbers");
    EXPECT_EQ(run["count"], run == root["runs"].back() ? 2 * 32 : 3000 * 24) << run;
    expectBothTimed(run);
  }
  EXPECT_TRUE(contains(root["runs"].back()["name"].get<std::string>(), csv));
  EXPECT_EQ(folder.entries().size(), 2u);

  const ProcessResult missing = mote({"bench", "formats", folder.file("none.prt"), "--count", "100"}, kWithoutVulkan);
  EXPECT_EQ(missing.exitCode, 2);
  EXPECT_TRUE(contains(missing.err, "none.prt"));
}

TEST(BenchCommand, LeavesTheDevicesHalvesOutWhereThereIsNone) {
  const TempFolder folder;
  const std::string report = folder.file("report.json");
  for (const char* which : {"lighting", "sort", "splat"}) {
    SCOPED_TRACE(which);
    const ProcessResult result = bench(which, report, kWithoutVulkan);
    ASSERT_EQ(result.exitCode, 0) << result.out << result.err;
    EXPECT_TRUE(contains(result.out, "device: none, so what runs on it is left out: "));
    const Json root = readJson(report);
    EXPECT_EQ(root["device"], "none");
    const Json& last = root["runs"].back();
    EXPECT_EQ(last["seconds_a"].size(), kRuns);
    EXPECT_EQ(last["seconds_b"].size(), 0u);
    EXPECT_TRUE(last["b"].is_null() && last["ratio_median"].is_null()) << last;
    EXPECT_EQ(last["check"]["passed"], true) << last;
  }
}

TEST(BenchCommand, DoesNotGoOnWithoutTheDeviceThatWasAskedFor) {
  const std::vector<std::string> arguments{"bench", "sort", "--count", "100", "--device", "no such device"};
  const ProcessResult misspelt = mote(arguments, kOnLavapipe);
  EXPECT_EQ(misspelt.exitCode, 2);
  EXPECT_TRUE(contains(misspelt.err, "no such device"));
  const ProcessResult none = mote(arguments, kWithoutVulkan);
  EXPECT_EQ(none.exitCode, 3);
  EXPECT_EQ(misspelt.out + none.out, "");
}

TEST(BenchCommand, RefusesWhatItCannotDoBeforeItStarts) {
  const TempFolder folder;
  const std::string missing = folder.file("missing/report.json");
  const std::vector<std::vector<std::string>> wrong{{"bench"},
                                                    {"bench", "octree"},
                                                    {"bench", "sort", "--count", "1"},
                                                    {"bench", "sort", "--count", "-5"},
                                                    {"bench", "sort", "--runs", "0"},
                                                    {"bench", "sort", "--report", missing}};
  for (const std::vector<std::string>& arguments : wrong) {
    const ProcessResult result = mote(arguments, kOnLavapipe);
    SCOPED_TRACE(arguments.back());
    EXPECT_EQ(result.exitCode, 2) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err, "");
  }
  EXPECT_TRUE(folder.entries().empty());
}

}  // namespace
}  // namespace mote::test
