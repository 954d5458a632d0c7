// mote farm: the scripts it writes, and what it says of a shot. That Slurm takes them is tests/farm's to show.
#include <fmt/format.h>

#include <filesystem>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

class MoteFarm : public testing::Test {
 protected:
  MoteFarm() {
    std::filesystem::create_directory(shot_);
    EXPECT_EQ(mote({"generate", "plume", "--count", "500", "--frames", "1-5", "-o", shot_ + "/p.#.prt"}).exitCode, 0);
    writeBytes(shot_ + "/scene.json", R"({"particles": [{"file": "p.#.prt"}],
      "output": {"size": [32, 24], "file": "o.#.exr"}})");
  }
  ProcessResult slurm(std::vector<std::string> more) const {
    more.insert(more.begin(), {"farm", "slurm", shot_ + "/scene.json", "--lighting", "cpu", "--raster", "cpu"});
    return mote(more, kWithoutVulkan);
  }
  ProcessResult check(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"farm", "check", shot_ + "/scene.json", "--lighting", "cpu", "--raster", "cpu",
                               "--frames", "1-5", "-o", shot_ + "/o.#.exr"});
    return mote(more, kWithoutVulkan);
  }
  ProcessResult render(const std::string& frames) const {
    return mote({"render", shot_ + "/scene.json", "--lighting", "cpu", "--raster", "cpu", "--frames", frames, "-o",
                 shot_ + "/o.#.exr", "--set", "/frames/first=1", "--set", "/frames/last=5"},
                kWithoutVulkan);
  }

  TempFolder folder_;
  const std::string shot_ = folder_.file("it's a shot");
};

TEST_F(MoteFarm, WritesTheShotAsAnArrayJob) {
  const ProcessResult result = slurm({"--frames", "1-5", "--per-task", "2", "-o", shot_ + "/o.#.exr", "--partition",
                                      "render", "--cpus", "3", "--set", "/medium/albedo=[0.9, 0.9, 0.9]"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "3 tasks of 2 frames, each with 3 CPUs, "));
  const std::string frames = readBytes(shot_ + "/scene.farm/frames.sbatch");
  const std::string scene = fmt::format("'{}'", folder_.file("it'\"'\"'s a shot/scene.json"));
  for (const std::string& line : {std::string("#SBATCH --array=1-3\n"), std::string("#SBATCH --cpus-per-task=3\n"),
                                  std::string("#SBATCH --partition=render\n"), std::string("#SBATCH --requeue\n"),
                                  " render " + scene + " '--set' '/medium/albedo=[0.9, 0.9, 0.9]' ",
                                  std::string(" '--set' '/frames/first=1' "), std::string("--resume")})
    EXPECT_TRUE(contains(frames, line)) << line << "\n" << frames;
  EXPECT_FALSE(contains(frames, "@"));
  // bash takes all of them.
  for (const char* script : {"frames.sbatch", "finish.sbatch", "submit.sh"})
    EXPECT_EQ(runProcess({"/bin/bash", "-n", shot_ + "/scene.farm/" + script}).exitCode, 0) << script;
}

TEST_F(MoteFarm, RefusesWhatCannotBecomeOne) {
  EXPECT_TRUE(contains(slurm({"--frames", "1-5", "-o", "one.exr"}).err, "#### in the name"));
  const ProcessResult missing = slurm({"--frames", "1-9", "-o", "o.#.exr"});
  EXPECT_EQ(missing.exitCode, 2);
  EXPECT_TRUE(contains(missing.err, "got none for frames 6-9"));
  writeBytes(shot_ + "/scene.json", R"({"particles": [{"generate": "ball", "count": 10}]})");
  const ProcessResult many = slurm({"--frames", "1-2001", "--per-task", "2", "-o", "o.#.exr"});
  EXPECT_EQ(many.exitCode, 2);
  EXPECT_TRUE(contains(many.err, "--per-task: expected at most 1000 tasks, got 1001"));
  // Without a Slurm.
  ProcessOptions alone = kWithoutVulkan;
  alone.environment["PATH"] = "/nonexistent";
  const ProcessResult noSlurm = mote({"farm", "slurm", shot_ + "/scene.json", "--lighting", "cpu", "--raster", "cpu",
                                      "--frames", "1-2", "-o", "o.#.exr", "--submit"},
                                     alone);
  EXPECT_EQ(noSlurm.exitCode, 3);
  EXPECT_TRUE(contains(noSlurm.err, "submit.sh: Slurm did not take the job"));
}

TEST_F(MoteFarm, ChecksWhetherAllIsThere) {
  ASSERT_EQ(render("1-3").exitCode, 0);
  ProcessResult result = check();
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(contains(result.out, "o.4.exr is missing\n"));
  EXPECT_TRUE(contains(result.out, "o.5.exr is missing\n3 of 5 frames are there\n"));
  // Parts of a shot agree on what the scene leaves open.
  ASSERT_EQ(render("4-5").exitCode, 0);
  result = check({"--set", "/frames/first=1", "--set", "/frames/last=5", "--previews", shot_ + "/v.#.png"});
  EXPECT_EQ(result.exitCode, 0) << result.out;
  EXPECT_EQ(result.out, "5 of 5 frames are there\n");
  for (const char* frame : {"1", "5"}) EXPECT_TRUE(std::filesystem::exists(shot_ + "/v." + frame + ".png"));
  const std::string whole = readBytes(shot_ + "/o.2.exr");
  writeBytes(shot_ + "/o.2.exr", whole.substr(0, whole.size() - 9));
  EXPECT_TRUE(contains(check().out, "o.2.exr is damaged, or of other files or settings\n4 of 5"));
}

}  // namespace
}  // namespace mote::test
