// The program as a user meets it: usage, generate, devices, and what it leaves behind when it is interrupted.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/core/output_file.h"
#include "host/image/exr.h"
#include "host/particles/formats/prt_reader.h"
#include "tests/cli/mote_program.h"

namespace mote {
namespace {

using nlohmann::json;
using test::contains;
using test::kOnLavapipe;
using test::kWithoutVulkan;
using test::ProcessResult;
using test::readBytes;
using test::TempFolder;
using test::writeBytes;
using Arguments = std::vector<std::string>;

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
