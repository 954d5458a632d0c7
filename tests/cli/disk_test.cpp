// Disks that are full and folders that are read-only, for every kind of output: exit code 3, a sentence with path and
// cause, and nothing half done.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "tests/cli/mote_program.h"
#include "tests/support/mounts.h"

namespace mote::test {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

constexpr std::size_t kPage = 4096;         // of tmpfs: what it hands out
constexpr std::size_t kRoom = 1024 * 1024;  // for any of the outputs, alone

std::size_t pages(std::size_t bytes) { return (bytes + kPage - 1) / kPage; }

/// A scene of four frames, its pictures on a disk with all the room they want, and a folder for a disk that has none.
class MoteOnADisk : public testing::Test {
 protected:
  void SetUp() override {
    if (!mountsRefused().empty())
      GTEST_SKIP() << "no disk can be mounted here (" << mountsRefused()
                   << "); what RLIMIT_FSIZE refuses is tested in batch_test, render_test, cli_test and convert_test";
    fs::create_directory(disk_);
    ASSERT_EQ(mote({"generate", "plume", "--count", "2000", "--frames", "1-4", "-o", in("p.#.prt")}).exitCode, 0);
    writeBytes(in("scene.json"), R"({"particles": [{"file": "p.#.prt"}], "medium": {"density_scale": 0.001},
      "output": {"size": [96, 64], "compression": "none"}, "camera": {"position": [0, 1, 6], "target": [0, 1, 0]},
      "lights": [{"name": "key", "position": [2, 3, 1]}]})");
    ASSERT_EQ(render({"--frames", "1-4", "-o", in("p.#.exr")}).exitCode, 0);
  }

  std::string in(const std::string& name) const { return folder_.file(name); }
  std::string onDisk(const std::string& name) const { return disk_ + "/" + name; }
  std::vector<std::string> onDisk() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(disk_)) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
  ProcessResult render(Arguments more) const {
    more.insert(more.begin(), {"render", in("scene.json"), "--lighting", "cpu", "--raster", "cpu"});
    return mote(more, kWithoutVulkan);
  }

  /// Everything that writes a file, once, to the disk: the arguments and the file.
  struct Command {
    Arguments arguments;
    std::string output;
  };
  std::vector<Command> commands() const {
    const std::string scene = in("scene.json"), elsewhere = in("elsewhere.exr");
    const Arguments render{"render", scene, "--lighting", "cpu", "--raster", "cpu", "--frames", "1", "-o"};
    std::vector<Command> all;
    const auto add = [&](Arguments arguments, std::initializer_list<std::string> more, const std::string& output) {
      arguments.insert(arguments.end(), more);
      arguments.push_back(onDisk(output));
      all.push_back({std::move(arguments), onDisk(output)});
    };
    add(render, {}, "out.exr");
    add(render, {elsewhere, "--preview"}, "out.png");
    add(render, {elsewhere, "--stats"}, "stats.json");
    add({"light", scene, "--lighting", "cpu", "-o"}, {}, "lit.prt");
    add({"generate", "ball", "--count", "3000", "-o"}, {}, "ball.prt");
    for (const char* name : {"c.prt", "c.ply", "c.csv", "c.npy"}) add({"convert", in("p.1.prt")}, {}, name);
    add({"convert", "--ascii", in("p.1.prt")}, {}, "text.ply");
    add({"convert", "--format", "prt2", in("p.1.prt")}, {}, "two.prt");
    add({"repair", in("p.1.prt")}, {}, "whole.ply");
    add({"compare", in("p.1.exr"), in("p.1.exr"), "--report"}, {}, "report.json");
    add({"compare", in("p.1.exr"), in("p.1.exr"), "--diff"}, {}, "diff.png");
    return all;
  }
  void expectRefused(const Command& command, const std::string& cause) const {
    const std::vector<std::string> before = onDisk();
    const ProcessResult result = mote(command.arguments, kWithoutVulkan);
    EXPECT_EQ(result.exitCode, 3) << command.output;
    EXPECT_TRUE(contains("\n" + result.err, "\nmote: " + command.output + ": "));
    EXPECT_TRUE(contains(result.err, ": " + cause + "\n"));
    EXPECT_EQ(onDisk(), before) << command.output;
  }

  TempFolder folder_;
  const std::string disk_ = folder_.file("disk");
};

TEST_F(MoteOnADisk, ThatIsFullNothingIsLeftAndOldFilesStay) {
  const Mount disk = Mount::disk(disk_, kRoom);
  const std::vector<Command> all = commands();
  for (const Command& command : all) writeBytes(command.output, "");  // empty files take no page
  writeBytes(onDisk("everything"), std::string(kRoom, 'x'));
  for (const Command& command : all) expectRefused(command, "No space left on device");
  for (const Command& command : all) EXPECT_EQ(readBytes(command.output), "") << command.output;
  // With room they all are written: it was the disk.
  fs::remove(onDisk("everything"));
  for (const Command& command : all) {
    const ProcessResult result = mote(command.arguments, kWithoutVulkan);
    fs::resize_file(command.output, fs::file_size(command.output) > 0 ? 0 : 1);
    EXPECT_EQ(result.exitCode, 0) << result.err;
  }
}

TEST_F(MoteOnADisk, ThatIsReadOnlyNoWorkIsBegun) {
  writeBytes(onDisk("old"), "old");
  const Mount disk = Mount::readOnly(disk_);
  for (const Command& command : commands()) expectRefused(command, "cannot write there: Read-only file system");
  EXPECT_FALSE(fs::exists(in("elsewhere.exr"))) << "the picture of a run whose preview had no place";
}

TEST_F(MoteOnADisk, ThatFillsUpTheFramesThatFitAreWholeAndResumeMakesTheOthers) {
  const std::size_t perFrame = pages(fs::file_size(in("p.1.exr")));
  const Mount disk = Mount::disk(disk_, (3 * perFrame - 1) * kPage);
  const Arguments arguments{"--frames", "1-4", "-o", onDisk("p.#.exr"), "--stats", in("stats.json")};
  const ProcessResult result = render(arguments);
  EXPECT_EQ(result.exitCode, 3);
  for (const std::string frame : {"3", "4"})
    EXPECT_TRUE(contains(result.err, "mote: frame " + frame + ": " + onDisk("p." + frame + ".exr") +
                                         ": writing the picture failed after "));
  EXPECT_TRUE(contains(result.err, " bytes: No space left on device\n"));
  EXPECT_TRUE(contains(result.err, "mote: 2 of 4 frames failed:\n          1-2  written\n"));
  EXPECT_EQ(onDisk(), (std::vector<std::string>{"p.1.exr", "p.2.exr"}));
  const auto stats = nlohmann::json::parse(readBytes(in("stats.json")));
  EXPECT_EQ(stats["frames"].size(), 2u);
  EXPECT_EQ(stats["failed"].size(), 2u);

  // Somebody makes room.
  const Mount larger = Mount::disk(disk_, 8 * perFrame * kPage);
  for (const std::string frame : {"1", "2"}) fs::copy_file(in("p." + frame + ".exr"), onDisk("p." + frame + ".exr"));
  Arguments again = arguments;
  again.push_back("--resume");
  ASSERT_EQ(render(again).exitCode, 0);
  EXPECT_EQ(nlohmann::json::parse(readBytes(in("stats.json")))["skipped"], (std::vector<int>{1, 2}));
  for (const std::string frame : {"1", "2", "3", "4"})
    EXPECT_EQ(readBytes(onDisk("p." + frame + ".exr")), readBytes(in("p." + frame + ".exr"))) << frame;
}

}  // namespace
}  // namespace mote::test
