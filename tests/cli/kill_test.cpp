// A batch that is killed again and again, at any moment, and resumed: what stands under a picture's name is that
// picture, whole, and in the end everything is as if nothing had been.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>
#include <random>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr int kFrames = 12, kKills = 30;
constexpr std::uint32_t kSeed = 20261126;

class MoteKilled : public testing::Test {
 protected:
  MoteKilled() {
    fs::create_directory(out_);
    writeBytes(folder_.file("scene.json"), R"({"particles": [{"generate": "plume", "count": 3000}],
      "medium": {"density_scale": 0.001}, "output": {"size": [320, 240], "precision": "float"},
      "camera": {"position": [0, 1, 6], "target": [0, 1, 0]}, "lights": [{"name": "key", "position": [2, 3, 1]}]})");
  }

  /// Goes on with the batch; killed after so long, if it has not come to its end before, or then as soon as a file is
  /// being written.
  ProcessResult render(Seconds alive, bool amidAFile = false) const {
    ProcessOptions options = kWithoutVulkan;
    options.signal = SIGKILL;
    const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(alive);
    options.signalWhen = [=, this] { return Clock::now() >= end && (!amidAFile || hasTemporary()); };
    return mote({"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu", "--resume", "--frames",
                 "1-" + std::to_string(kFrames), "-o", out_ + "/p.####.exr", "--preview", out_ + "/p.####.png",
                 "--stats", out_ + "/stats.json"},
                options);
  }
  bool hasTemporary() const {
    const fs::directory_iterator all(out_);
    return std::any_of(begin(all), end(all),
                       [](const auto& entry) { return entry.path().filename().string().starts_with('.'); });
  }
  /// The pictures by their names, and how many temporaries lie beside them.
  struct Found {
    std::map<std::string, std::string> pictures;
    int temporaries = 0;
  };
  Found found() const {
    Found all;
    for (const auto& entry : fs::directory_iterator(out_)) {
      const std::string name = entry.path().filename();
      if (name.starts_with('.'))
        ++all.temporaries;
      else if (name != "stats.json")
        all.pictures[name] = readBytes(entry.path());
    }
    return all;
  }
  void clear() const {
    for (const auto& [name, bytes] : found().pictures) fs::remove(out_ + "/" + name);
  }
  static int framesIn(const std::string& log) {
    int frames = 0;
    for (std::size_t at = 0; (at = log.find("\nframe ", at)) != std::string::npos; ++at) ++frames;
    return frames;
  }

  TempFolder folder_;
  const std::string out_ = folder_.file("out");
};

TEST_F(MoteKilled, ThirtyTimesAtRandomHasWholePicturesAtEveryMomentAndAllOfThemInTheEnd) {
  const Clock::time_point begin = Clock::now();
  ASSERT_EQ(render(Seconds(1000)).exitCode, 0);
  const double batch = Seconds(Clock::now() - begin).count();
  const Found whole = found();
  ASSERT_EQ(whole.pictures.size(), 2u * kFrames);
  ASSERT_EQ(whole.temporaries, 0);
  clear();

  std::mt19937 random(kSeed);
  const auto expectWhole = [&](const std::string& when) {
    const Found now = found();
    for (const auto& [name, bytes] : now.pictures) {
      const auto same = whole.pictures.find(name);
      ASSERT_TRUE(same != whole.pictures.end()) << name;
      EXPECT_TRUE(bytes == same->second) << when << ": " << name << " has " << bytes.size() << " bytes, of "
                                         << same->second.size();
    }
    // What one run leaves, and no more: the next has removed it.
    EXPECT_LE(now.temporaries, 1) << when;
  };
  int kills = 0, batches = 0, drawn = 0, withTemporary = 0;
  while (kills < kKills) {
    // From before its first line to a third of the batch. Writing is a small part of that: every third kill waits for
    // it.
    const double alive = std::uniform_real_distribution<double>(0, batch / 3)(random);
    const ProcessResult result = render(Seconds(alive), kills % 3 == 2);
    drawn += framesIn("\n" + result.err);
    if (result.exitCode == 0) {
      EXPECT_TRUE(found().pictures == whole.pictures);
      ++batches;
      clear();
      continue;
    }
    ASSERT_EQ(result.exitCode, -SIGKILL) << result.err;
    ++kills;
    withTemporary += found().temporaries;
    expectWhole("kill " + std::to_string(kills));
  }
  const int before = static_cast<int>(found().pictures.size());
  const ProcessResult last = render(Seconds(1000));
  ASSERT_EQ(last.exitCode, 0) << last.err;
  drawn += framesIn("\n" + last.err);
  ++batches;
  const Found end = found();
  EXPECT_TRUE(end.pictures == whole.pictures);
  EXPECT_EQ(end.temporaries, 0);
  std::printf(
      "seed %u: a batch of %d frames takes %.2f s; %d kills in %.1f s, %d of which left a temporary; %d batches "
      "came to their end, with %d frames drawn, %d more than they have; the last run found %d files and drew %d "
      "frames\n",
      kSeed, kFrames, batch, kills, Seconds(Clock::now() - begin).count(), withTemporary, batches, drawn,
      drawn - batches * kFrames, before, framesIn("\n" + last.err));
}

}  // namespace
}  // namespace mote::test
