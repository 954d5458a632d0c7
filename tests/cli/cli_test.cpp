// The program as a user meets it: usage, generate, info, compare, devices, and what it leaves behind.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/core/output_file.h"
#include "host/image/exr.h"
#include "host/particles/formats/prt_reader.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/cli/mote_program.h"

namespace mote {
namespace {

using nlohmann::json;
using test::contains;
using test::kOnLavapipe;
using test::kWithoutVulkan;
using test::makeBall;
using test::ProcessResult;
using test::readBytes;
using test::TempFolder;
using test::writeBytes;
using Arguments = std::vector<std::string>;

const std::string kData = MOTE_SHARED_DATA;

// ---- usage ----

TEST(MoteUsage, IsExitCode2WithTheReasonOnStderrOnly) {
  struct Case {
    Arguments arguments;
    std::string message;
  };
  for (const auto& [arguments, message] : {
           Case{{"rendr", "x.json"}, "\"rendr\" is no command of mote; the nearest is \"render\""},
           Case{{"--frobnicate"}, "\"--frobnicate\" is no flag of mote"},
           Case{{"generate", "cloud", "-o", "/nonexistent/x.prt"}, "--count is required"},
           Case{{"generate", "sphere", "--count", "5", "-o", "/nonexistent/x.prt"}, "sphere not in {cloud,plume,ball}"},
           Case{{"generate", "ball", "--count", "5", "--seed", "-1", "-o", "/nonexistent/x.prt"},
                "--seed: expected a whole number"},
           Case{{"generate", "ball", "--count", "5", "--seed", "1.5", "-o", "/nonexistent/x.prt"}, "--seed"},
           Case{{"compare", "a.exr"}, "second is required"},
           Case{{"devices", "extra"}, "extra"},
           Case{{"devices", "--threads", "-2"}, "--threads: Value -2 not in range"},
           Case{{"devices", "-q", "-v"}, "--quiet excludes --verbose"},
       }) {
    const ProcessResult result = test::mote(arguments);
    EXPECT_EQ(result.exitCode, 2) << message;
    EXPECT_TRUE(contains(result.err, message));
    EXPECT_TRUE(contains(result.err, "--help"));
    EXPECT_EQ(result.out, "");
  }
}

TEST(MoteUsage, WithoutACommandIsTheHelpAndExitCode2) {
  const ProcessResult result = test::mote({});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, "Subcommands:"));
}

TEST(MoteUsage, HelpListsEveryCommandAndCommonFlag) {
  const ProcessResult help = test::mote({"--help"});
  EXPECT_EQ(help.exitCode, 0);
  EXPECT_EQ(help.err, "");
  for (const char* word : {"render", "light", "crosscheck", "generate", "convert", "repair", "info", "compare", "bench",
                           "devices", "--threads", "--device", "--validate", "--quiet", "--verbose", "--version"})
    EXPECT_TRUE(contains(help.out, word));
}

TEST(MoteUsage, EveryCommandHasItsOwnHelp) {
  for (const char* command :
       {"render", "light", "crosscheck", "generate", "convert", "repair", "info", "compare", "bench", "devices"}) {
    const ProcessResult help = test::mote({command, "--help"});
    EXPECT_EQ(help.exitCode, 0) << command;
    EXPECT_TRUE(contains(help.out, std::string("Usage: mote ") + command));
  }
}

TEST(MoteUsage, VersionIsPrintedBeforeAndAfterACommand) {
  for (const Arguments& arguments : {Arguments{"--version"}, Arguments{"devices", "--version"}}) {
    const ProcessResult result = test::mote(arguments);
    EXPECT_EQ(result.exitCode, 0);
    EXPECT_EQ(result.out, "mote " MOTE_VERSION "\n");
  }
}

TEST(MoteUsage, CommonFlagsMayStandBeforeOrAfterTheCommand) {
  const TempFolder folder;
  const Arguments command{"generate", "ball", "--count", "100", "-o", folder.file("b.prt")};
  Arguments before{"-q", "--threads", "1"}, after = command;
  before.insert(before.end(), command.begin(), command.end());
  after.insert(after.end(), {"-q", "--threads", "1"});
  for (const Arguments& arguments : {before, after}) {
    const ProcessResult result = test::mote(arguments);
    EXPECT_EQ(result.exitCode, 0);
    EXPECT_EQ(result.err, "") << "-q was not obeyed";
  }
}

// ---- generate ----

TEST(MoteGenerate, GivesTheSameBytesForTheSameSeedOnAnyNumberOfThreads) {
  const TempFolder folder;
  const auto bytesOf = [&](const std::string& kind, const std::string& seed, const std::string& threads) {
    const ProcessResult result = test::mote(
        {"generate", kind, "--count", "3k", "--seed", seed, "--threads", threads, "-o", folder.file("x.prt")});
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return readBytes(folder.file("x.prt"));
  };
  for (const std::string kind : {"ball", "cloud", "plume"}) {
    const std::string first = bytesOf(kind, "5", "1");
    EXPECT_TRUE(first == bytesOf(kind, "5", "3")) << kind;
    EXPECT_FALSE(first == bytesOf(kind, "6", "1")) << kind;
  }
}

TEST(MoteGenerate, UnderstandsEveryFormOfCount) {
  const TempFolder folder;
  const std::pair<const char*, std::uint64_t> forms[] = {{"1500", 1500},    {"1.5k", 1500}, {"1.5e3", 1500},
                                                         {"0.0015M", 1500}, {"2K", 2000},   {"1", 1}};
  for (const auto& [text, count] : forms) {
    const ProcessResult result = test::mote({"generate", "ball", "--count", text, "-o", folder.file("x.prt")});
    ASSERT_EQ(result.exitCode, 0) << text << ": " << result.err;
    EXPECT_EQ(PrtReader(folder.file("x.prt")).count(), count) << text;
  }
}

TEST(MoteGenerate, RefusesCountsThatAreNoNumberOfParticles) {
  const TempFolder folder;
  for (const char* text : {"0", "1.5", "-3", "9x", "k", "5e9", "nan", "inf", "1e400", "9 M"}) {
    const ProcessResult result =
        test::mote({"generate", "ball", std::string("--count=") + text, "-o", folder.file("x.prt")});
    EXPECT_EQ(result.exitCode, 2) << text;
    EXPECT_TRUE(contains(result.err, "--count")) << text;
  }
  EXPECT_TRUE(folder.entries().empty());
}

TEST(MoteGenerate, WritesOneFileAFrameAndSaysSo) {
  const TempFolder folder;
  const ProcessResult result =
      test::mote({"generate", "plume", "--count", "500", "--frames", "8-10x2", "-o", folder.file("p.####.prt")});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  std::vector<std::string> names = folder.entries();
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"p.0008.prt", "p.0010.prt"}));
  EXPECT_FALSE(readBytes(folder.file("p.0008.prt")) == readBytes(folder.file("p.0010.prt")));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 2);
  EXPECT_TRUE(contains(result.err, folder.file("p.0010.prt") + ": 500 particles"));
  EXPECT_EQ(result.out, "");
}

TEST(MoteGenerate, NeedsAPatternForSeveralFrames) {
  const TempFolder folder;
  const ProcessResult result =
      test::mote({"generate", "plume", "--count", "500", "--frames", "1-2", "-o", folder.file("p.prt")});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, "####"));
  EXPECT_TRUE(folder.entries().empty());
}

TEST(MoteGenerate, RecordsWhatItsFilesAreMadeOf) {
  const TempFolder folder;
  ASSERT_EQ(test::mote({"generate", "plume", "--count", "300", "--seed", "12", "-o", folder.file("p.prt")}).exitCode,
            0);
  const PrtReader file(folder.file("p.prt"));
  for (const char* channel : {"Position", "Radius", "Density", "Velocity", "ID"})
    EXPECT_NE(file.header().channel(channel), nullptr) << channel;
  const Metadata expected = Metadata::int32("", "CoordSys", 1);
  ASSERT_NE(file.header().meta("", "CoordSys"), nullptr);
  EXPECT_EQ(file.header().meta("", "CoordSys")->bytes, expected.bytes);
  const std::uint32_t rate[] = {24, 1};
  ASSERT_NE(file.header().meta("", "FrameRate"), nullptr);
  EXPECT_EQ(file.header().meta("", "FrameRate")->bytes, std::string(reinterpret_cast<const char*>(rate), sizeof rate));
  ASSERT_NE(file.header().meta("", "GeneratorSeed"), nullptr);
  EXPECT_EQ(file.header().meta("", "GeneratorSeed")->bytes, "12");
}

TEST(MoteGenerate, RefusesPlacesThatCannotBeWrittenBeforeAnyWork) {
  const TempFolder folder;
  writeBytes(folder.file("plain"), "a file");
  std::filesystem::create_directory(folder.file("folder.prt"));
  const std::pair<std::string, std::string> cases[] = {
      {folder.file("missing/x.prt"), "does not exist"}, {folder.file("plain/x.prt"), "is not a folder"},
      {folder.file("folder.prt"), "is a folder"},       {"/proc/x.prt", "cannot write there"},
      {folder.file("x.ply"), "ends in .prt"},           {folder.file("a.##.b.##.prt"), "one run of #"}};
  for (const auto& [path, message] : cases) {
    // Two thousand million particles would take minutes: the refusal comes first.
    const ProcessResult result = test::mote({"generate", "ball", "--count", "2G", "-o", path});
    EXPECT_EQ(result.exitCode, 2) << path;
    EXPECT_TRUE(contains(result.err, path.substr(path.rfind('/'))));
    EXPECT_TRUE(contains(result.err, message));
  }
  EXPECT_EQ(folder.entries().size(), 2u);
}

TEST(MoteGenerate, AFullDiskIsExitCode3AndLeavesTheOldFile) {
  const TempFolder folder;
  writeBytes(folder.file("x.prt"), "old");
  const ProcessResult result =
      test::mote({"generate", "ball", "--count", "5000", "-o", folder.file("x.prt")}, {.largestFile = 4096});
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_TRUE(contains(result.err, "x.prt"));
  EXPECT_TRUE(contains(result.err, "writing failed"));
  EXPECT_EQ(readBytes(folder.file("x.prt")), "old");
  EXPECT_EQ(folder.entries().size(), 1u);
}

// ---- interruption ----

bool hasTemporary(const TempFolder& folder) {
  const std::vector<std::string> names = folder.entries();
  return std::any_of(names.begin(), names.end(), [](const std::string& name) { return name.starts_with('.'); });
}

TEST(MoteInterrupted, ExitsAsShellsHaveItAndLeavesOnlyWholeFiles) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const TempFolder folder;
    // Hours of frames: the program cannot be done before the signal comes, whatever the machine.
    const ProcessResult result =
        test::mote({"generate", "ball", "--count", "100k", "--frames", "1-9999999", "-o", folder.file("b.#.prt")},
                   {.signal = signal, .signalWhen = [&] { return hasTemporary(folder); }});
    EXPECT_EQ(result.exitCode, 128 + signal);
    EXPECT_FALSE(hasTemporary(folder));
    for (const std::string& name : folder.entries()) {
      std::vector<vec3> positions;
      const ChannelRequest request{"Position", &positions};
      PrtReader(folder.file(name)).read({&request, 1});
      EXPECT_EQ(positions.size(), 100'000u) << name;
    }
  }
}

/// In a process of its own: two files being written, one of them done, then a signal.
[[noreturn]] void interruptMyself(const TempFolder& folder) {
  removeTemporaryFilesOnSignal();
  OutputFile done(folder.file("done.exr"));
  done.commit();
  OutputFile half(folder.file("half.exr"));
  writeBytes(half.temporaryPath(), "half of it");
  ::kill(::getpid(), SIGINT);
  for (;;) ::pause();
}

TEST(RemoveTemporaryFilesOnSignalDeathTest, RemovesWhatIsNotCommitted) {
  GTEST_FLAG_SET(death_test_style, "fast");
  const TempFolder folder;
  EXPECT_EXIT(interruptMyself(folder), testing::ExitedWithCode(130), "");
  EXPECT_EQ(folder.entries(), std::vector<std::string>{"done.exr"});
}

// ---- info ----

json infoOf(const std::string& path) {
  const ProcessResult result = test::mote({"info", "--json", path});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  return json::parse(result.out);
}

TEST(MoteInfo, DescribesAParticleFile) {
  const TempFolder folder;
  const json info = infoOf(makeBall(folder));
  EXPECT_EQ(info["kind"], "particles");
  EXPECT_EQ(info["format"], "PRT 1.1");
  EXPECT_EQ(info["count"], 2000);
  EXPECT_EQ(info["bytes_per_particle"], 28);
  ASSERT_EQ(info["channels"].size(), 4u);
  const json& position = info["channels"][0];
  EXPECT_EQ(position["name"], "Position");
  EXPECT_EQ(position["arity"], 3);
  EXPECT_EQ(position["not_finite"], 0);
  for (int axis = 0; axis < 3; ++axis) {
    // 2000 points in the unit ball: the outermost along an axis is within 0.2 of 1 (chance of none in a cap of height
    // 0.2: (1 − 0.028)^2000), the mean within 5 standard errors of 0 (σ = 1/√5, so 0.05).
    EXPECT_GE(position["min"][axis], -1);
    EXPECT_LE(position["min"][axis], -0.8);
    EXPECT_LE(position["max"][axis], 1);
    EXPECT_GE(position["max"][axis], 0.8);
    EXPECT_NEAR(position["mean"][axis].get<double>(), 0, 0.05);
    EXPECT_EQ(info["bounds"]["min"][axis], position["min"][axis]);
  }
  // Equal cross-sections 8π/(3N), as float32.
  EXPECT_NEAR(info["channels"][2]["mean"][0].get<double>(), 8 * M_PI / 3 / 2000, 1e-9);
  EXPECT_EQ(info["radius"]["from"], "channel Radius");
  EXPECT_EQ(info["channels"][3]["name"], "ID");
  EXPECT_EQ(info["channels"][3]["max"][0], 1999);
}

TEST(MoteInfo, PrintsATableForPeople) {
  const TempFolder folder;
  const ProcessResult result = test::mote({"info", makeBall(folder)});
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.err, "");
  for (const char* part :
       {"PRT 1.1, 2000 particles of 28 bytes (56.0 kB)", "3 × float32", "not finite", "bounds", "CoordSys"})
    EXPECT_TRUE(contains(result.out, part));
}

TEST(MoteInfo, CountsNotFiniteNumbersAndKeepsThemOutOfTheStatistics) {
  const TempFolder folder;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<vec3> position{{0, 0, 0}, {1, kNan, 2}, {kInfinity, kNan, 4}, {3, 1, 6}};
  const std::vector<float> density{kNan, kNan, -kInfinity, kNan};
  const std::vector<std::uint64_t> id{0, 1, 18446744073709551615ull, 2};
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(position)),
                                       PrtColumn::of("Density", std::span<const float>(density)),
                                       PrtColumn::of("ID", std::span<const std::uint64_t>(id))};
  writePrt(folder.file("x.prt"), columns);
  const json info = infoOf(folder.file("x.prt"));
  EXPECT_EQ(info["channels"][0]["not_finite"], 2);
  EXPECT_EQ(info["channels"][0]["min"], (json{0, 0, 0}));
  EXPECT_EQ(info["channels"][0]["max"], (json{3, 1, 6}));
  EXPECT_NEAR(info["channels"][0]["mean"][0].get<double>(), 4.0 / 3, 1e-12);
  EXPECT_EQ(info["channels"][1]["not_finite"], 4);
  EXPECT_TRUE(info["channels"][1]["min"][0].is_null());
  EXPECT_EQ(info["channels"][2]["max"][0].get<std::uint64_t>(), 18446744073709551615ull)
      << "64-bit numbers keep all digits";
  // The two that have a place are √(9 + 1 + 36) apart; 1.5 × that is the automatic radius.
  EXPECT_NEAR(info["radius"]["mean"].get<double>(), 1.5 * std::sqrt(46.0), 1e-6);
  EXPECT_TRUE(contains(info["radius"]["from"], "auto"));
}

TEST(MoteInfo, DescribesAFileWithoutParticles) {
  const TempFolder folder;
  const std::vector<vec3> none;
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(none))};
  writePrt(folder.file("x.prt"), columns);
  const json info = infoOf(folder.file("x.prt"));
  EXPECT_EQ(info["count"], 0);
  EXPECT_TRUE(info["bounds"]["min"][0].is_null());
  EXPECT_EQ(test::mote({"info", folder.file("x.prt")}).exitCode, 0);
}

TEST(MoteInfo, ReadsTheMakersFileAndTheSmoke) {
  const json fractal = infoOf(kData + "/prt/prt_fractal_for_krscene.prt");
  EXPECT_EQ(fractal["count"], 312);
  // The box that its own header gives, to the digits of PROVENANCE.txt.
  EXPECT_NEAR(fractal["bounds"]["min"][2].get<double>(), -1.996, 1e-4);
  EXPECT_NEAR(fractal["bounds"]["max"][1].get<double>(), 1.5374, 1e-4);
  const json smoke = infoOf(kData + "/smoke1/smoke1_350k_power05.prt");
  EXPECT_EQ(smoke["count"], 350'000);
  const json& density = smoke["channels"][1];
  EXPECT_EQ(density["name"], "Density");
  // README of the data: 2.5e-4 … 0.19, sum 18518.5.
  EXPECT_NEAR(density["min"][0].get<double>(), 2.5e-4, 1e-5);
  EXPECT_NEAR(density["max"][0].get<double>(), 0.19, 0.005);
  EXPECT_NEAR(density["mean"][0].get<double>() * 350'000, 18518.5, 0.5);
}

TEST(MoteInfo, RefusesMalformedFilesWithTheirName) {
  for (const std::string name :
       {"massive_chunk_divisible.prt", "massive_chunk_indivisible.prt", "negative_eight.prt"}) {
    const ProcessResult result = test::mote({"info", kData + "/prt/" + name});
    EXPECT_EQ(result.exitCode, 2) << name;
    EXPECT_TRUE(contains(result.err, name + ": metadata chunk 'Metb'"));
    EXPECT_EQ(result.out, "");
  }
}

TEST(MoteInfo, RefusesWhatItCannotRead) {
  const TempFolder folder;
  writeBytes(folder.file("notes.txt"), "hello");
  writeBytes(folder.file("fake.prt"), "no particles at all");
  writeBytes(folder.file("fake.exr"), "no picture at all");
  const std::pair<std::string, std::string> cases[] = {
      {folder.file("notes.txt"), "a particle file (PRT 1.0 and 1.1, PRT 2"},
      {folder.file("fake.prt"), "fake.prt"},
      {folder.file("fake.exr"), "fake.exr"},
      {folder.file("note.txt"), "nearest names in its folder: 'notes.txt'"},
      {folder.path(), "a folder"}};
  for (const auto& [path, message] : cases) {
    const ProcessResult result = test::mote({"info", path});
    EXPECT_EQ(result.exitCode, 2) << path;
    EXPECT_TRUE(contains(result.err, message));
  }
}

TEST(MoteInfo, GivesOneLineOfJsonAFile) {
  const TempFolder folder;
  const std::string ball = makeBall(folder);
  writeExr(folder.file("p.exr"), Image(3, 2, true), {.strings = {{"mote:note", "made here"}}});
  writeBytes(folder.file("s.json"), R"({"particles": [{"file": "ball.prt"}, {"generate": "cloud", "count": 1000}],
    "lights": [{"name": "a", "type": "point", "position": [0, 5, 0], "intensity": 1},
               {"name": "b", "type": "directional", "direction": [0, -1, 0], "irradiance": 1, "casts_shadows": false}]})");
  const ProcessResult result = test::mote({"info", "--json", ball, folder.file("p.exr"), folder.file("s.json")});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  std::vector<json> infos;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) infos.push_back(json::parse(line));
  ASSERT_EQ(infos.size(), 3u);
  EXPECT_EQ(infos[1]["kind"], "picture");
  EXPECT_EQ(infos[1]["width"], 3);
  EXPECT_EQ(infos[1]["height"], 2);
  EXPECT_EQ(infos[1]["channels"].size(), 5u) << "R G B A Z";
  EXPECT_EQ(infos[1]["attributes"]["mote:note"], "made here");
  EXPECT_EQ(infos[2]["kind"], "scene");
  EXPECT_EQ(infos[2]["particles"], 3000);
  EXPECT_EQ(infos[2]["sources"][0]["count"], 2000);
  EXPECT_EQ(infos[2]["lights"].size(), 2u);
  EXPECT_EQ(infos[2]["estimate"]["rays"], 3000) << "one light casts shadows";
  EXPECT_GT(infos[2]["estimate"]["host_bytes"], 3000 * 24);
  EXPECT_GT(infos[2]["estimate"]["lighting_seconds"], 0);
  for (const char* name : {"p.exr", "s.json"}) EXPECT_EQ(test::mote({"info", folder.file(name)}).exitCode, 0) << name;
}

TEST(MoteInfo, ShowsTheRangesOfAbsorptionAndEmission) {
  const TempFolder folder;
  const std::vector<vec3> position{{0, 0, 0}, {1, 0, 0}}, absorption{{0, 1, 2}, {3, 0, 0}},
      emission{{5, 6, 7}, {1, 8, 0}};
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", position), PrtColumn::of("Absorption", absorption),
                                       PrtColumn::of("Emission", emission)};
  writePrt(folder.file("x.prt"), columns);
  const json channels = infoOf(folder.file("x.prt"))["channels"];
  EXPECT_EQ(channels[1]["name"], "Absorption");
  EXPECT_EQ(channels[1]["max"], (json{3, 1, 2}));
  EXPECT_EQ(channels[2]["name"], "Emission");
  EXPECT_EQ(channels[2]["min"], (json{1, 6, 0}));
  // Both take memory: 12 bytes a particle each as they are read, and as they are drawn; with absorption also the
  // factors of the colours and the tree's other two channels. A few particles only, so what goes by the pixel is AR AG
  // AB.
  writePrt(folder.file("y.prt"), {columns.data(), 1});
  const auto bytes = [&](const char* file) {
    writeBytes(folder.file("s.json"), R"({"particles": [{"file": ")" + std::string(file) + R"(", "radius": 1}]})");
    return infoOf(folder.file("s.json"))["estimate"]["host_bytes"].get<double>();
  };
  const double colors = 1280.0 * 720 * (12 + 2 * 3);
  EXPECT_EQ(bytes("x.prt") - bytes("y.prt"), 2 * (2 * 12 + 2 * 12 + 12 + 8) + colors);
}

TEST(MoteInfo, CountsTheMemoryOfWhatASceneAdds) {
  const TempFolder folder;
  const auto estimate = [&](const std::string& more) {
    writeBytes(folder.file("s.json"), R"({"particles": [{"generate": "ball", "count": 1000000}],
      "lights": [{"name": "a"}, {"name": "b"}])" +
                                          more + "}");
    return infoOf(folder.file("s.json"))["estimate"];
  };
  const auto more = [&](const char* which, const std::string& part) {
    return estimate(part)[which].get<double>() - estimate("")[which].get<double>();
  };
  const double n = 1e6, pixels = 1280 * 720;
  const std::string solid = R"(, "solids": [{"file": "wall.obj"}])";
  // Light of its own for each particle, splats for one more light, and layers of each light, twice while half is
  // written.
  EXPECT_GE(more("host_bytes", R"(, "output": {"aovs": ["lights"]})"), n * 2 * 12 + pixels * 2 * 12);
  EXPECT_EQ(more("host_bytes", R"(, "output": {"aovs": ["Z", "velocity", "optical_depth", "shadow"]})"),
            pixels * (4 + 8 + 4 + 2 * 4));
  EXPECT_GE(more("host_bytes", R"(, "medium": {"extinction": [1, 2, 3]})"), n * 12 + pixels * 12);
  EXPECT_GE(more("device_bytes", R"(, "medium": {"extinction": [1, 2, 3]})"), n * 12);
  EXPECT_GE(more("host_bytes", solid), pixels * 76) << "surfaces";
  // Nine tenths fewer in the tree, 20 bytes for each receiver.
  EXPECT_LT(more("host_bytes", R"(, "lighting": {"subsample": 0.1})"), 0);
  EXPECT_GT(more("host_bytes", R"(, "lighting": {"subsample": 0.999})"), n * 19);
  // The next frame's particles: position, radius, density, ID.
  EXPECT_EQ(more("host_bytes", R"(, "frames": {"first": 1, "last": 2})"), n * 28);
  // What stands in no header is named.
  EXPECT_EQ(estimate("")["not_counted"].dump(), R"(["a Vulkan driver's own"])");
  EXPECT_TRUE(contains(estimate(solid)["not_counted"].dump(), "the solids' meshes and their tree"));
  EXPECT_TRUE(contains(test::mote({"info", folder.file("s.json")}).out, "without the solids' meshes and their tree"));
}

// What a sanitized program takes is mostly the sanitizer's: shadow memory, and what was freed held back.
#if !defined(__SANITIZE_ADDRESS__)
/// The estimate is held against what renders really take: peak_rss of --stats.
TEST(MoteInfo, EstimatesTheMemoryOfARenderWithinAThird) {
  const TempFolder folder;
  writeBytes(folder.file("wall.obj"), "v -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\n");
  const std::string layers = R"("Z", "lights", "shadow", "velocity", "optical_depth")";
  const std::string solid = R"("solids": [{"file": "wall.obj"}],)";
  const std::pair<std::string, std::string> cases[] = {
      {"", ""}, {layers, ""}, {"", R"("medium": {"extinction": [1, 2, 3]},)"}, {"", solid}, {layers, solid}};
  for (const auto& [aovs, more] : cases) {
    // Small splats and no rays: memory is the same, and it takes no time.
    writeBytes(folder.file("s.json"), fmt::format(R"({{"particles": [{{"generate": "ball", "count": 400000}}], {}
                               "lights": [{{"name": "a", "shadow_density": 0}}, {{"name": "b", "shadow_density": 0}}],
                               "view": {{"radius_scale": 0.2}},
                               "output": {{"size": [1280, 720], "aovs": [{}], "compression": "none"}}}})",
                                                  more, aovs));
    const ProcessResult result = test::mote({"render", folder.file("s.json"), "--lighting", "cpu", "--raster", "cpu",
                                             "-o", folder.file("o.exr"), "--stats", folder.file("stats.json")},
                                            kWithoutVulkan);
    ASSERT_EQ(result.exitCode, 0) << result.err;
    const json stats = json::parse(readBytes(folder.file("stats.json")));
    const double measured = stats["frames"][0]["bytes"]["peak_rss"];
    const double estimated = infoOf(folder.file("s.json"))["estimate"]["host_bytes"];
    std::printf("%5.0f MB, estimated %5.0f MB: %s %s\n", measured / 1e6, estimated / 1e6, more.c_str(), aovs.c_str());
    EXPECT_LT(std::abs(estimated - measured), measured / 3) << more << " " << aovs;
  }
}
#endif

TEST(MoteInfo, DescribesThePartsOfAScene) {
  const TempFolder folder;
  writeBytes(folder.file("s.json"), R"({"particles": [{"generate": "ball", "count": 1000}],
    "lights": [{"name": "a"}, {"name": "b", "type": "spot"}, {"name": "c", "type": "directional"}],
    "lighting": {"subsample": 0.25, "error": 0.01, "radius_scale": 2},
    "solids": [{"file": "ground.##.obj", "mode": "holdout"}, {"name": "pole", "file": "pole.obj", "casts_shadows": false}],
    "camera": {"type": "orthographic", "position": [0, 0, 5], "target": [0, 0, 1], "height": 3, "shutter": [0, 0.25],
               "aperture_radius": 0.5}})");
  const json info = infoOf(folder.file("s.json"));
  EXPECT_EQ(info["lights"][0]["type"], "point");
  EXPECT_EQ(info["lights"][1]["type"], "spot");
  EXPECT_EQ(info["lights"][2]["type"], "directional");
  EXPECT_EQ(info["solids"][0]["name"], "solid0");
  EXPECT_EQ(info["solids"][0]["file"], folder.file("ground.01.obj"));
  EXPECT_EQ(info["solids"][0]["mode"], "holdout");
  EXPECT_EQ(info["solids"][1]["casts_shadows"], false);
  EXPECT_EQ(info["lighting"], (json{{"subsample", 0.25}, {"compensate", true}, {"radius_scale", 2}, {"error", 0.01f}}));
  EXPECT_EQ(info["camera"], (json{{"type", "orthographic"},
                                  {"height", 3},
                                  {"fitted", false},
                                  {"keys", 0},
                                  {"shutter", {0, 0.25}},
                                  {"aperture_radius", 0.5},
                                  {"focus_distance", 4}}));
  const ProcessResult text = test::mote({"info", folder.file("s.json")});
  EXPECT_EQ(text.exitCode, 0) << text.err;
  for (const char* part : {"a (point), b (spot), c (directional)", "solid0: holdout, ", "pole: shaded, ",
                           "orthographic, height 3, shutter 0 to 0.25 s, aperture radius 0.5, sharp at 4",
                           "25 % of the particles in the octree, that stand for all; radii × 2\n"})
    EXPECT_TRUE(contains(text.out, part)) << text.out;
  EXPECT_FALSE(contains(text.out, "ΔT")) << "nobody measures the error of a fixed share";
}

TEST(MoteInfo, LeavesOpenWhatParticlesAndKeysDecide) {
  const TempFolder folder;
  writeBytes(folder.file("s.json"), R"({"particles": [{"generate": "ball", "count": 1000}],
    "lighting": {"subsample": "auto", "error": 0.01},
    "camera": {"type": "orthographic", "aperture_radius": 0.5, "keys": [{"frame": 1, "up": [0, 0, 1]}]}})");
  const json info = infoOf(folder.file("s.json"));
  EXPECT_EQ(info["camera"]["fitted"], true);
  EXPECT_EQ(info["camera"]["keys"], 1);
  EXPECT_TRUE(info["camera"]["height"].is_null());
  EXPECT_TRUE(info["camera"]["focus_distance"].is_null());
  EXPECT_EQ(info["lighting"]["subsample"], "auto");
  const ProcessResult text = test::mote({"info", folder.file("s.json")});
  for (const char* part : {"orthographic, fitted to the particles, 1 key, aperture radius 0.5, sharp at the target",
                           "the smallest share of the particles with a mean |ΔT| <= 0.01 in the octree"})
    EXPECT_TRUE(contains(text.out, part)) << text.out;
}

TEST(MoteInfo, NamesTheMissingParticleFileOfAScene) {
  const TempFolder folder;
  writeBytes(folder.file("s.json"), R"({"particles": [{"file": "gone.prt"}]})");
  const ProcessResult result = test::mote({"info", folder.file("s.json")});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, folder.file("gone.prt")));
}

TEST(MoteInfo, AFullStdoutIsExitCode3) {
  const TempFolder folder;
  const ProcessResult result = test::mote({"info", makeBall(folder)}, {.outputFile = "/dev/full"});
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_TRUE(contains(result.err, "stdout"));
}

// ---- compare ----

Image flatImage(int width, int height, float value) {
  Image image(width, height);
  for (vec4& pixel : image.pixels) pixel = vec4(value, value, value, 1);
  return image;
}

TEST(MoteCompare, EqualPicturesAreExitCode0) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  const ProcessResult result = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), "--report",
                                           folder.file("r.json"), "--diff", folder.file("d.png")});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "no difference"));
  const json report = json::parse(readBytes(folder.file("r.json")));
  EXPECT_EQ(report["rmse"], 0);
  EXPECT_EQ(report["passed"], true);
  EXPECT_EQ(readBytes(folder.file("d.png")).substr(1, 3), "PNG");
}

TEST(MoteCompare, DifferentPicturesAreExitCode1AndTheReportIsWritten) {
  const TempFolder folder;
  Image other = flatImage(8, 4, 0.5f);
  other.at(3, 2).g = 0.75f;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  writeExr(folder.file("b.exr"), other, {});
  const Arguments compare{"compare", folder.file("a.exr"), folder.file("b.exr"), "--report", folder.file("r.json")};
  const ProcessResult result = test::mote(compare);
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(contains(result.out, "differs: RMSE"));
  const json report = json::parse(readBytes(folder.file("r.json")));
  EXPECT_EQ(report["passed"], false);
  EXPECT_EQ(report["failures"].size(), 2u);
  EXPECT_DOUBLE_EQ(report["channels"]["G"]["max"], 0.25);  // exact in half
  EXPECT_EQ(report["channels"]["G"]["max_at"], (json{3, 2}));
  // RMSE over all four channels: √(0.25² / 128) = 0.0221; 31 of 32 pixels agree.
  Arguments tolerant = compare;
  tolerant.insert(tolerant.end(), {"--max-rmse", "0.0222", "--within", "0.96"});
  EXPECT_EQ(test::mote(tolerant).exitCode, 0);
  Arguments strict = compare;
  strict.insert(strict.end(), {"--max-rmse", "0.0220", "--within", "0.96"});
  EXPECT_EQ(test::mote(strict).exitCode, 1);
}

TEST(MoteCompare, NotFinitePixelsNeverPass) {
  const TempFolder folder;
  Image image = flatImage(100, 100, 0.5f);
  image.at(1, 1).r = std::numeric_limits<float>::quiet_NaN();
  writeExr(folder.file("a.exr"), image, {});
  const ProcessResult result = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), "--within", "0"});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(contains(result.out, "1 pixels are not finite"));
}

TEST(MoteCompare, ALayerThatOnlyOnePictureHasFails) {
  const TempFolder folder;
  Image more = flatImage(8, 4, 0.5f);
  more.opticalDepth.assign(32, 0.25f);
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  writeExr(folder.file("b.exr"), more, {});
  const std::pair<const char*, std::array<std::string, 2>> cases[] = {
      {"second", {folder.file("a.exr"), folder.file("b.exr")}},
      {"first", {folder.file("b.exr"), folder.file("a.exr")}}};
  for (const auto& [which, files] : cases) {
    const ProcessResult result = test::mote({"compare", files[0], files[1], "--report", folder.file("r.json")});
    EXPECT_EQ(result.exitCode, 1) << result.out;
    EXPECT_TRUE(contains(result.out, fmt::format("differs: only the {} picture has optical_depth", which)));
    const json report = json::parse(readBytes(folder.file("r.json")));
    EXPECT_EQ(report["passed"], false);
    EXPECT_EQ(report["failures"].size(), 1u);
    EXPECT_EQ(report[fmt::format("only_in_{}", which)], json{"optical_depth"});
  }
}

TEST(MoteCompare, RefusesLimitsThatAreNone) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  const std::array<std::string, 2> cases[] = {
      {"--within", "1.5"}, {"--within", "nan"}, {"--max-rmse", "-1"}, {"--max-rmse", "nan"}};
  for (const auto& [flag, value] : cases) {
    const ProcessResult result = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), flag, value});
    EXPECT_EQ(result.exitCode, 2) << flag << " " << value;
    EXPECT_TRUE(contains(result.err, flag + ": expected"));
  }
}

TEST(MoteCompare, PicturesOfDifferentSizesAreBadInput) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  writeExr(folder.file("b.exr"), flatImage(4, 8, 0.5f), {});
  const ProcessResult result =
      test::mote({"compare", folder.file("a.exr"), folder.file("b.exr"), "--report", folder.file("r.json")});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, folder.file("b.exr") + ": size: expected 8 × 4"));
  EXPECT_FALSE(std::filesystem::exists(folder.file("r.json")));
}

TEST(MoteCompare, MissingPicturesAndFoldersAreBadInputAndNothingIsWritten) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  const ProcessResult missing = test::mote({"compare", folder.file("a.exr"), folder.file("gone.exr")});
  EXPECT_EQ(missing.exitCode, 2);
  EXPECT_TRUE(contains(missing.err, "gone.exr"));
  const ProcessResult noFolder = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), "--report",
                                             folder.file("r.json"), "--diff", folder.file("no/d.png")});
  EXPECT_EQ(noFolder.exitCode, 2);
  EXPECT_TRUE(contains(noFolder.err, folder.file("no")));
  EXPECT_EQ(folder.entries(), std::vector<std::string>{"a.exr"});
}

// ---- devices ----

TEST(MoteDevices, ListsLavapipeAsUsable) {
  const ProcessResult text = test::mote({"devices"}, kOnLavapipe);
  EXPECT_EQ(text.exitCode, 0) << text.err;
  for (const char* part : {"0  llvmpipe", "type    cpu", "driver", "memory", "has all it needs"})
    EXPECT_TRUE(contains(text.out, part));
  const ProcessResult result = test::mote({"devices", "--json"}, kOnLavapipe);
  EXPECT_EQ(result.exitCode, 0);
  const json devices = json::parse(result.out);
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0]["number"], 0);
  EXPECT_EQ(devices[0]["type"], "cpu");
  EXPECT_EQ(devices[0]["usable"], true);
  EXPECT_GT(devices[0]["memory"], 0);
}

TEST(MoteDevices, WithoutVulkanIsExitCode3AndSaysWhatWorks) {
  const ProcessResult result = test::mote({"devices"}, kWithoutVulkan);
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_EQ(result.out, "");
  EXPECT_TRUE(contains(result.err, "no Vulkan device"));
  EXPECT_TRUE(contains(result.err, "--lighting cpu --raster cpu"));
}

TEST(MoteDevices, RunsUnderTheValidationLayers) {
  const ProcessResult result = test::mote({"devices", "--validate"}, kOnLavapipe);
  EXPECT_EQ(result.exitCode, 0) << result.err;
}

}  // namespace
}  // namespace mote
