// What `mote` says of its work: a bar on a terminal, events with --log json, nothing with -q (docs/log.md).
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Json = nlohmann::json;

constexpr const char* kWipe = "\r\033[K";

/// One a line; a line that is none is a failure.
std::vector<Json> eventsOf(const std::string& text) {
  std::vector<Json> events;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    Json event = Json::parse(line, nullptr, false);
    EXPECT_TRUE(event.is_object() && event.contains("time") && event.contains("event")) << line;
    if (event.is_object()) events.push_back(std::move(event));
  }
  return events;
}

/// "frame_begin 2", of those that are told in every run in the same order.
std::vector<std::string> story(const std::vector<Json>& events) {
  std::vector<std::string> names;
  for (const Json& event : events) {
    std::string name = event.value("event", "");
    if (name == "stage" || name == "progress" || name == "info") continue;
    if (event.contains("frame")) name += " " + std::to_string(event["frame"].get<int>());
    names.push_back(name);
  }
  return names;
}

/// All with that name, and in a frame where one is given.
std::vector<Json> named(const std::vector<Json>& events, const std::string& name, int frame = -1) {
  std::vector<Json> found;
  for (const Json& event : events)
    if (event.value("event", "") == name && (frame < 0 || event.value("frame", -1) == frame)) found.push_back(event);
  return found;
}

/// Frames of smoke, in the light of as many lights as it takes to be slow.
class MoteLog : public testing::Test {
 protected:
  void makeScene(std::size_t particles, int frames, int lights) const {
    ASSERT_EQ(mote({"generate", "plume", "--count", std::to_string(particles), "--frames",
                    "1-" + std::to_string(frames), "-o", folder_.file("p.#.prt")})
                  .exitCode,
              0);
    Json scene = Json::parse(R"({"particles": [{"file": "p.#.prt"}], "output": {"size": [48, 32]},
      "medium": {"density_scale": 0.001}, "camera": {"position": [0, 1, 6], "target": [0, 1, 0]}, "lights": []})");
    for (int k = 0; k < lights; ++k)
      scene["lights"].push_back({{"name", "l" + std::to_string(k)}, {"position", {2, 3, 1 + k}}});
    writeBytes(folder_.file("scene.json"), scene.dump());
  }
  ProcessResult render(std::vector<std::string> more, ProcessOptions options = {}) const {
    std::vector<std::string> arguments{"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    options.environment = kWithoutVulkan.environment;
    options.environment["TERM"] = "xterm";
    return mote(arguments, options);
  }
  void cutOff(const std::string& name) const {
    const std::string whole = readBytes(folder_.file(name));
    writeBytes(folder_.file(name), whole.substr(0, whole.size() / 2));
  }

  TempFolder folder_;
};

TEST_F(MoteLog, DrawsABarWithStageShareRateAndTimeOnATerminal) {
  makeScene(100'000, 1, 200);  // ten seconds on a core
  const ProcessResult result =
      render({"--threads", "1", "-o", folder_.file("a.exr")}, {.signalAt = "s left", .terminal = true});
  EXPECT_EQ(result.exitCode, 130);
  const std::size_t bar = result.err.find(std::string(kWipe) + "lighting [");
  ASSERT_NE(bar, std::string::npos) << result.err;
  const std::string text = result.err.substr(bar, result.err.find("s left", bar) - bar);
  EXPECT_TRUE(contains(text, " %  ") && contains(text, " rays/s  ")) << text;
  EXPECT_TRUE(result.err.ends_with(kWipe)) << result.err;  // and nothing of it stays
}

TEST_F(MoteLog, TellsOfABatchWhichFrameIsAtWorkAndWhenAllAreDone) {
  makeScene(20'000, 1, 60);
  Json scene = Json::parse(readBytes(folder_.file("scene.json")));
  scene["particles"][0]["file"] = "p.1.prt";
  writeBytes(folder_.file("scene.json"), scene.dump());
  const ProcessResult result = render({"--threads", "1", "--frames", "1-90", "-o", folder_.file("a.#.exr")},
                                      {.signalAt = "  all ", .terminal = true});
  EXPECT_EQ(result.exitCode, 130);
  const std::size_t bar = result.err.rfind(kWipe, result.err.find("  all "));
  EXPECT_TRUE(contains(result.err.substr(bar), std::string(kWipe) + "frame ")) << result.err.substr(bar);
  EXPECT_TRUE(contains(result.err.substr(bar), "/90  "));
  EXPECT_TRUE(contains(result.err, std::string(kWipe) + "frame 1/90  lighting ["));
  // Lines that stay begin where the bar was.
  EXPECT_TRUE(contains(result.err, std::string(kWipe) + "frame 1: 20000 particles") ||
              contains(result.err, "\nframe 1: 20000 particles"));
}

TEST_F(MoteLog, WritesWholeLinesAndNoControlCharactersWhereThereIsNoTerminal) {
  makeScene(2000, 2, 1);
  const ProcessResult result = render({"--frames", "1-2", "-o", folder_.file("a.#.exr")});
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_TRUE(contains(result.err, "\nframe 2: 2000 particles"));
  for (const char c : result.err) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= ' ') << int(c);
}

TEST_F(MoteLog, TellsEventsInTheirOrderAsJson) {
  makeScene(2000, 3, 2);
  cutOff("p.2.prt");
  const ProcessResult result =
      render({"--frames", "1-3", "--log", "json", "--threads", "2", "-o", folder_.file("a\xff.#.exr")});
  EXPECT_EQ(result.exitCode, 2);
  const std::vector<Json> events = eventsOf(result.err);
  EXPECT_EQ(story(events),
            (std::vector<std::string>{"start", "frame_begin 1", "frame_done 1", "frame_begin 2", "frame_failed 2",
                                      "frame_begin 3", "frame_done 3", "summary", "end"}));
  const Json start = events.front(), end = events.back();
  EXPECT_EQ(start["command"], "mote render");
  EXPECT_EQ(start["threads"], 2);
  EXPECT_TRUE(start["version"].is_string() && start["device"].is_string());
  EXPECT_EQ(start["time"].get<std::string>().size(), std::string("2026-11-26T22:00:00.123Z").size());
  EXPECT_EQ(end["exit_code"], 2);
  EXPECT_GT(end["seconds"].get<double>(), 0);

  const Json info = named(events, "info").at(0);
  EXPECT_TRUE(contains(info["message"].get<std::string>(), "lighting and picture on the CPU"));
  EXPECT_EQ(info["lighting"], "cpu");
  const Json begin = named(events, "frame_begin", 2).at(0);
  EXPECT_EQ(begin["index"], 2);
  EXPECT_EQ(begin["frames"], 3);
  const Json failed = named(events, "frame_failed").at(0);
  EXPECT_EQ(failed["exit_code"], 2);
  EXPECT_TRUE(contains(failed["error"].get<std::string>(), "cut off"));
  const Json summary = named(events, "summary").at(0);
  EXPECT_EQ(summary["written"], 2);
  EXPECT_EQ(summary["failed"], 1);
  EXPECT_EQ(summary["skipped"], 0);

  const Json done = named(events, "frame_done", 3).at(0);
  EXPECT_EQ(done["particles"], 2000);
  EXPECT_EQ(done["lights"], 2);
  EXPECT_TRUE(contains(done["file"].get<std::string>(), "a\xEF\xBF\xBD.3.exr"));  // U+FFFD for what is no UTF-8
  std::vector<std::string> stages;
  for (const Json& stage : named(events, "stage", 3)) {
    EXPECT_GE(stage["seconds"].get<double>(), 0);
    if (std::find(stages.begin(), stages.end(), stage["stage"]) == stages.end()) stages.push_back(stage["stage"]);
    EXPECT_TRUE(done["seconds"].contains(stage["stage"]));
  }
  EXPECT_EQ(stages, (std::vector<std::string>{"load", "octree", "lighting", "splat", "sort", "write"}));
}

TEST_F(MoteLog, TellsOncePerSecondHowFarAStageIs) {
  makeScene(100'000, 2, 60);
  const ProcessResult result =
      render({"--threads", "1", "--frames", "1-2", "--log", "json", "-o", folder_.file("a.#.exr")},
             {.signalAt = "\"frame_begin\",\"frame\":2"});
  EXPECT_EQ(result.exitCode, 130);
  const std::vector<Json> events = eventsOf(result.err);
  EXPECT_EQ(events.back()["event"], "end");
  EXPECT_EQ(events.back()["exit_code"], 130);
  const std::vector<Json> progress = named(events, "progress", 1);
  ASSERT_FALSE(progress.empty());
  EXPECT_LE(progress.size(), 1 + events.back()["seconds"].get<double>());
  const auto counted =
      std::find_if(progress.rbegin(), progress.rend(), [](const Json& e) { return e["stage"] == "lighting"; });
  ASSERT_NE(counted, progress.rend());
  const Json& last = *counted;
  EXPECT_EQ(last["unit"], "rays");
  EXPECT_EQ(last["total"], 6'000'000);
  EXPECT_GT(last["done"], 0);
  EXPECT_LT(last["done"], last["total"]);
  const double seconds = last["seconds"], rate = last["rate"], left = last["remaining_seconds"];
  EXPECT_NEAR(rate * seconds, last["done"].get<double>(), 0.1 * rate * seconds);  // six digits, milliseconds apart
  EXPECT_NEAR((seconds + left) * rate, 6e6, 0.1 * 6e6);
  EXPECT_EQ(last["index"], 1);
  EXPECT_EQ(last["frames"], 2);
  EXPECT_TRUE(last["batch_remaining_seconds"].is_null());  // no frame is done yet
}

TEST_F(MoteLog, TellsWhichFramesAreThereAlready) {
  makeScene(2000, 3, 1);
  ASSERT_EQ(render({"--frames", "1-3", "-o", folder_.file("a.#.exr")}).exitCode, 0);
  std::filesystem::remove(folder_.file("a.2.exr"));
  const ProcessResult result = render({"--frames", "1-3", "--resume", "--log=json", "-o", folder_.file("a.#.exr")});
  EXPECT_EQ(story(eventsOf(result.err)), (std::vector<std::string>{"start", "frame_skipped 1", "frame_skipped 3",
                                                                   "frame_begin 2", "frame_done 2", "summary", "end"}));
}

TEST_F(MoteLog, TellsTheErrorOfARunThatStops) {
  makeScene(2000, 3, 1);
  cutOff("p.2.prt");
  const ProcessResult result =
      render({"--frames", "1-3", "--stop-on-error", "--log", "json", "-o", folder_.file("a.#.exr")});
  EXPECT_EQ(result.exitCode, 2);
  const std::vector<Json> events = eventsOf(result.err);
  EXPECT_EQ(story(events), (std::vector<std::string>{"start", "frame_begin 1", "frame_done 1", "frame_begin 2",
                                                     "frame_failed 2", "summary", "error", "end"}));
  EXPECT_EQ(named(events, "error").at(0)["exit_code"], 2);
  EXPECT_EQ(named(events, "summary").at(0)["failed"], 1);
}

TEST_F(MoteLog, QuietIsQuiet) {
  makeScene(2000, 3, 1);
  for (const char* format : {"text", "json"}) {
    const ProcessResult good = render({"-q", "--log", format, "-o", folder_.file("a.exr")}, {.terminal = true});
    EXPECT_EQ(good.exitCode, 0);
    EXPECT_EQ(good.err, "") << format;
  }
  cutOff("p.2.prt");
  const ProcessResult bad = render({"-q", "--log", "json", "--frames", "1-3", "-o", folder_.file("a.#.exr")});
  EXPECT_EQ(story(eventsOf(bad.err)), (std::vector<std::string>{"frame_failed 2"}));
  const ProcessResult text = render({"-q", "--frames", "1-3", "-o", folder_.file("a.#.exr")});
  EXPECT_TRUE(text.err.starts_with("mote: frame 2: ")) << text.err;
}

TEST_F(MoteLog, TellsWhatOthersWriteToStderrAsJsonToo) {
  ProcessOptions options = kOnLavapipe;
  options.environment["VK_LOADER_DEBUG"] = "all";  // the Vulkan loader tells much
  const std::vector<Json> events = eventsOf(mote({"--log", "json", "devices"}, options).err);
  EXPECT_EQ(events.back()["event"], "end");
  const std::vector<Json> infos = named(events, "info");
  EXPECT_GT(std::count_if(infos.begin(), infos.end(), [](const Json& e) { return e.value("source", "") == "stderr"; }),
            5);
}

TEST_F(MoteLog, TellsWrongUsageAsJsonToo) {
  const std::vector<std::vector<std::string>> wrong{
      {"--log", "json"},
      {"--log", "json", "render"},
      {"render", "--nonsense", "--log=json", "scene.json"},
      {"--log", "json", "rendr"},
      {"--log", "json", "--threads", "many", "render", "scene.json"},
      {"render", folder_.file("none\xff.json"), "--log", "json"},
      {"render", folder_.file("none.json"), "--log", "json", "-o", folder_.file("a.png")}};
  for (const std::vector<std::string>& arguments : wrong) {
    const ProcessResult result = mote(arguments);
    EXPECT_EQ(result.exitCode, 2);
    const std::vector<Json> errors = named(eventsOf(result.err), "error");
    ASSERT_EQ(errors.size(), 1u) << result.err;
    EXPECT_EQ(errors[0]["exit_code"], 2);
    EXPECT_FALSE(errors[0]["message"].get<std::string>().empty());
  }
  const ProcessResult format = mote({"--log", "xml", "devices"});
  EXPECT_EQ(format.exitCode, 2);
  EXPECT_TRUE(contains(format.err, "mote: --log: "));
}

}  // namespace
}  // namespace mote::test
