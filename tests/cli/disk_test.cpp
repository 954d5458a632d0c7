// Disks that are full and folders that are read-only, for every kind of output: exit code 3, a sentence with path and
// cause, and nothing half done. Where this process may mount nothing, a limit on the size of files stands for the disk
// and /sys for the folder.
#include <algorithm>
#include <filesystem>
#include <memory>
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
    return mote(more, options_);
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
    if (mounts_) {  // a limit would refuse what is written elsewhere as well
      add(render, {elsewhere, "--preview"}, "out.png");
      add(render, {elsewhere, "--stats"}, "stats.json");
    }
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
    const ProcessResult result = mote(command.arguments, options_);
    EXPECT_EQ(result.exitCode, 3) << command.output;
    EXPECT_TRUE(contains("\n" + result.err, "\nmote: " + command.output + ": "));
    EXPECT_TRUE(contains(result.err, ": " + cause));
    EXPECT_EQ(onDisk(), before) << command.output;
  }

  TempFolder folder_;
  std::string disk_ = folder_.file("disk");
  const bool mounts_ = mountsRefused().empty();
  ProcessOptions options_ = kWithoutVulkan;
};

/// What `mount` makes, where this process may mount something.
template <class Make>
std::unique_ptr<const Mount> mounted(bool allowed, const Make& mount) {
  return allowed ? std::unique_ptr<const Mount>(new Mount(mount())) : nullptr;
}

TEST_F(MoteOnADisk, ThatIsFullNothingIsLeftAndOldFilesStay) {
  const auto disk = mounted(mounts_, [&] { return Mount::disk(disk_, kRoom); });
  const std::vector<Command> all = commands();
  for (const Command& command : all) writeBytes(command.output, "");  // empty files take no page
  if (mounts_)
    writeBytes(onDisk("everything"), std::string(kRoom, 'x'));
  else
    options_.largestFile = 64;
  for (const Command& command : all) expectRefused(command, mounts_ ? "No space left on device\n" : "File too large\n");
  for (const Command& command : all) EXPECT_EQ(readBytes(command.output), "") << command.output;
  // With room they all are written: it was the disk.
  fs::remove(onDisk("everything"));
  options_.largestFile.reset();
  for (const Command& command : all) {
    const ProcessResult result = mote(command.arguments, options_);
    fs::resize_file(command.output, fs::file_size(command.output) > 0 ? 0 : 1);
    EXPECT_EQ(result.exitCode, 0) << result.err;
  }
}

TEST_F(MoteOnADisk, ThatIsReadOnlyNoWorkIsBegun) {
  writeBytes(onDisk("old"), "old");
  const auto disk = mounted(mounts_, [&] { return Mount::readOnly(disk_); });
  if (!mounts_) disk_ = "/sys";  // not even root makes files there
  for (const Command& command : commands())
    expectRefused(command, mounts_ ? "cannot write there: Read-only file system\n" : "cannot write there: ");
  EXPECT_FALSE(fs::exists(in("elsewhere.exr"))) << "the picture of a run whose preview had no place";
}

TEST_F(MoteOnADisk, ThatFillsUpTheFramesThatFitAreWholeAndResumeMakesTheOthers) {
  const std::size_t perFrame = pages(fs::file_size(in("p.1.exr")));
  const auto disk = mounted(mounts_, [&] { return Mount::disk(disk_, (3 * perFrame - 1) * kPage); });
  Arguments arguments{"--frames", "1-4", "-o", onDisk("p.#.exr"), "--stats", in("stats.json")};
  if (!mounts_) {  // frames of which the last two, large blobs, pack worse
    ASSERT_EQ(mote({"generate", "plume", "--count", "20", "--frames", "3-4", "-o", in("p.#.prt")}).exitCode, 0);
    arguments.insert(arguments.end(), {"--set", R"(/output/compression="zip")"});
    Arguments whole = arguments;
    whole[3] = in("p.#.exr");
    ASSERT_EQ(render(whole).exitCode, 0);
    const auto size = [&](const char* frame) { return fs::file_size(in(std::string("p.") + frame + ".exr")); };
    options_.largestFile = std::max(size("1"), size("2"));
    ASSERT_GT(std::min(size("3"), size("4")), *options_.largestFile);
  }
  const ProcessResult result = render(arguments);
  EXPECT_EQ(result.exitCode, 3);
  for (const std::string frame : {"3", "4"})
    EXPECT_TRUE(contains(result.err, "mote: frame " + frame + ": " + onDisk("p." + frame + ".exr") +
                                         ": writing the picture failed after "));
  EXPECT_TRUE(contains(result.err, mounts_ ? " bytes: No space left on device\n" : " bytes: File too large\n"));
  EXPECT_TRUE(contains(result.err, "mote: 2 of 4 frames failed:\n          1-2  written\n"));
  EXPECT_EQ(onDisk(), (std::vector<std::string>{"p.1.exr", "p.2.exr"}));
  const auto stats = nlohmann::json::parse(readBytes(in("stats.json")));
  EXPECT_EQ(stats["frames"].size(), 2u);
  EXPECT_EQ(stats["failed"].size(), 2u);

  // Somebody makes room.
  const auto larger = mounted(mounts_, [&] { return Mount::disk(disk_, 8 * perFrame * kPage); });
  options_.largestFile.reset();
  for (const std::string frame : {"1", "2"})
    if (mounts_) fs::copy_file(in("p." + frame + ".exr"), onDisk("p." + frame + ".exr"));
  Arguments again = arguments;
  again.push_back("--resume");
  ASSERT_EQ(render(again).exitCode, 0);
  EXPECT_EQ(nlohmann::json::parse(readBytes(in("stats.json")))["skipped"], (std::vector<int>{1, 2}));
  for (const std::string frame : {"1", "2", "3", "4"})
    EXPECT_EQ(readBytes(onDisk("p." + frame + ".exr")), readBytes(in("p." + frame + ".exr"))) << frame;
}

}  // namespace
}  // namespace mote::test
