// What every module stands on: files that appear whole or not at all, messages, random numbers, hashes, blocks, bins,
// boxes.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "host/core/bins.h"
#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/log_event.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/core/random.h"
#include "host/core/sha256.h"
#include "host/core/timer.h"
#include "tests/support/contains.h"

namespace mote {
namespace {
namespace fs = std::filesystem;

/// A folder of its own for each test.
class InFolder : public testing::Test {
 protected:
  InFolder()
      : folder_(fs::path(testing::TempDir()) /
                fmt::format("mote_core_test_{}_{}", ::getpid(),
                            testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(folder_);
  }
  ~InFolder() override {
    std::error_code ignored;
    fs::permissions(folder_, fs::perms::owner_all, ignored);
    fs::remove_all(folder_, ignored);
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t fileCount() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }
  static std::string read(const std::string& name) {
    std::ifstream file(name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static void write(const std::string& name, const std::string& bytes) {
    std::ofstream(name, std::ios::binary) << bytes;
  }

  fs::path folder_;
};

template <class E>
std::string messageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const E& error) {
    return error.what();
  }
  return "(nothing thrown)";
}

using test::contains;

// --- errors -------------------------------------------------------------------------------------------------------

TEST(InputError, JoinsPlaceFieldExpectedGotAndHint) {
  EXPECT_STREQ(InputError("s.json", "/a", "a number", "-3").what(), "s.json: /a: expected a number, got -3");
  EXPECT_STREQ(InputError("s.json", "", "a number", "-3", "as in 4").what(),
               "s.json: expected a number, got -3 (as in 4)");
}

TEST(CheckDeathTest, PrintsBothSides) {
  const int left = 3, right = 4;
  EXPECT_DEATH(MOTE_CHECK(left, ==, right), "left == right fails: 3 against 4");
  MOTE_CHECK(left, <, right);
}

// --- output files -------------------------------------------------------------------------------------------------

using OutputFileTest = InFolder;

TEST_F(OutputFileTest, AppearsOnlyAtCommit) {
  const std::string target = path("a.exr");
  {
    OutputFile file(target);
    EXPECT_EQ(file.path(), target);
    EXPECT_EQ(fs::path(file.temporaryPath()).parent_path(), folder_);
    EXPECT_EQ(fs::path(file.temporaryPath()).extension(), ".exr");
    EXPECT_EQ(fs::path(file.temporaryPath()).filename().string().front(), '.');
    write(file.temporaryPath(), "picture");
    EXPECT_FALSE(fs::exists(target));
    file.commit();
  }
  EXPECT_EQ(read(target), "picture");
  EXPECT_EQ(fileCount(), 1u);
}

TEST_F(OutputFileTest, LeavesTheOldFileAndNoTraceWithoutCommit) {
  const std::string target = path("a.exr");
  write(target, "old");
  try {
    OutputFile file(target);
    write(file.temporaryPath(), "half of the ne");
    throw MachineError("power cut");
  } catch (const MachineError&) {
  }
  EXPECT_EQ(read(target), "old");
  EXPECT_EQ(fileCount(), 1u);
}

TEST_F(OutputFileTest, ReplacesAnOldFile) {
  write(path("a"), "old");
  writeWholeFile(path("a"), "new");
  EXPECT_EQ(read(path("a")), "new");
  EXPECT_EQ(fileCount(), 1u);
}

TEST_F(OutputFileTest, GivesEachObjectItsOwnTemporary) {
  const OutputFile one(path("a.exr")), two(path("a.exr"));
  EXPECT_NE(one.temporaryPath(), two.temporaryPath());
}

TEST_F(OutputFileTest, RefusesPathsThatCannotBeWrittenBeforeAnyWork) {
  write(path("file"), "x");
  const auto message = [](const std::string& target) {
    return messageOf<InputError>([&] { OutputFile file(target); });
  };
  EXPECT_TRUE(contains(message(path("none/a.exr")), "none' does not exist"));
  EXPECT_TRUE(contains(message(path("file/a.exr")), "file' is not a folder"));
  EXPECT_TRUE(contains(message(folder_.string()), "is a folder, not a file"));
  EXPECT_TRUE(contains(message(path("")), "names no file"));
  EXPECT_TRUE(contains(message(""), "names no file"));
  EXPECT_TRUE(contains(message(path(std::string(300, 'n'))), "cannot write there: "));
  EXPECT_EQ(fileCount(), 1u);
}

TEST_F(OutputFileTest, SaysWhenTheTemporaryWasTakenAway) {
  OutputFile file(path("a"));
  fs::remove(file.temporaryPath());
  EXPECT_TRUE(contains(messageOf<MachineError>([&] { file.commit(); }), "cannot reopen what was written"));
  EXPECT_EQ(fileCount(), 0u);
}

TEST_F(OutputFileTest, ReportsAFailedWriteAndLeavesNothing) {
  // A file size limit stands for a full disk: the kernel refuses the write with EFBIG instead of ENOSPC.
  rlimit old{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto oldHandler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, old.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message =
      messageOf<MachineError>([&] { writeWholeFile(path("big"), std::string(1'000'000, 'x')); });
  ::setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, oldHandler);
  EXPECT_TRUE(contains(message, "writing 1000000 bytes failed: "));
  EXPECT_EQ(fileCount(), 0u);
}

TEST_F(OutputFileTest, OnlyWhatDeadProcessesLeftOfOnesOwnFilesIsStale) {
  // A process that is killed while it writes two files, and this one, which lives.
  const pid_t killed = ::fork();
  if (killed == 0) {
    const OutputFile mine(path("a.1.exr")), others(path("b.exr"));
    write(mine.temporaryPath(), "half");
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(killed, &status, 0), killed);
  ASSERT_TRUE(WIFSIGNALED(status));
  const OutputFile living(path("a.1.exr"));
  // By its name of another machine; by its name of nothing that Mote writes.
  const std::string own = fs::path(living.temporaryPath()).filename();
  std::string foreign = own;
  foreign.replace(foreign.find(".part") - 8, 8, "0123abcd");
  for (const std::string& name : {foreign, std::string(".a.1.exr.swp"), std::string(".a.1.part.exr")})
    write(path(name), "x");
  ASSERT_EQ(fileCount(), 6u);

  const auto mine = [](const std::string& name) { return name == "a.1.exr"; };
  EXPECT_EQ(removeStaleTemporaries(folder_.string(), mine), 1u);
  EXPECT_EQ(fileCount(), 5u);
  EXPECT_TRUE(fs::exists(living.temporaryPath()));
  EXPECT_TRUE(fs::exists(path(foreign))) << "its machine may be at work on it";
  fs::last_write_time(path(foreign), fs::file_time_type::clock::now() - std::chrono::hours(25));
  EXPECT_EQ(removeStaleTemporaries(folder_.string(), mine), 1u);
  EXPECT_FALSE(fs::exists(path(foreign)));
  EXPECT_EQ(removeStaleTemporaries(folder_.string(), [](const std::string&) { return true; }), 1u) << "b.exr's";
  EXPECT_EQ(removeStaleTemporaries(path("none"), mine), 0u);
}

TEST_F(OutputFileTest, KeepsEveryByte) {
  std::string bytes;
  for (int i = 0; i < 70'000; ++i) bytes += static_cast<char>(i);
  writeWholeFile(path("a"), bytes);
  EXPECT_EQ(read(path("a")), bytes);
}

// --- log ----------------------------------------------------------------------------------------------------------

class Log : public testing::Test {
 protected:
  void SetUp() override { takeWarnings(); }
  void TearDown() override {
    setVerbosity(Verbosity::Normal);
    setLogFormat(LogFormat::Text);
    takeWarnings();
  }
  static std::string captured(const std::function<void()>& action) {
    testing::internal::CaptureStderr();
    action();
    return testing::internal::GetCapturedStderr();
  }
};

TEST_F(Log, ShowsWhatTheVerbosityAsksFor) {
  const auto all = [] {
    logInfo("i");
    logVerbose("v");
    logWarning("w");
  };
  setVerbosity(Verbosity::Normal);
  EXPECT_EQ(captured(all), "i\nwarning: w\n");
  takeWarnings();
  setVerbosity(Verbosity::Verbose);
  EXPECT_EQ(captured(all), "i\nv\nwarning: w\n");
  takeWarnings();
  setVerbosity(Verbosity::Quiet);
  EXPECT_EQ(captured(all), "");
  EXPECT_EQ(takeWarnings(), std::vector<std::string>{"w"});
}

TEST_F(Log, PrintsAndKeepsEachWarningOnceInOrder) {
  const std::string text = captured([] {
    for (const char* line : {"b", "a", "b"}) logWarning(line);
  });
  EXPECT_EQ(text, "warning: b\nwarning: a\n");
  EXPECT_EQ(takeWarnings(), (std::vector<std::string>{"b", "a"}));
  EXPECT_TRUE(takeWarnings().empty());
  EXPECT_EQ(captured([] { logWarning("b"); }), "warning: b\n");
}

TEST_F(Log, KeepsAThreadsWarningsApartWhereAsked) {
  std::vector<std::string> kept, inner;
  const std::string text = captured([&] {
    const WarningsKept keep(kept);
    logWarning("a");
    {
      const WarningsKept again(inner);
      logWarning("b");
    }
    logWarning("c");
    std::thread([] { logWarning("other"); }).join();
  });
  EXPECT_EQ(text, "warning: other\n");
  EXPECT_EQ(kept, (std::vector<std::string>{"a", "c"}));
  EXPECT_EQ(inner, std::vector<std::string>{"b"});
  EXPECT_EQ(takeWarnings(), std::vector<std::string>{"other"});
}

TEST_F(Log, TakesWarningsFromManyThreads) {
  setVerbosity(Verbosity::Quiet);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([] {
      for (int i = 0; i < 100; ++i) logWarning(std::to_string(i));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(takeWarnings().size(), 100u);
}

TEST_F(Log, DrawsNoProgressBarWhereThereIsNoTerminal) {
  EXPECT_EQ(captured([] {
              Progress progress("lighting", 10, "rays");
              progress.advance(5);
            }),
            "");
}

TEST_F(Log, WritesOneEventALineFromManyThreads) {
  setLogFormat(LogFormat::Json);
  const std::string text = captured([] {
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([t] {
        for (int i = 0; i < 100; ++i) logWarning(fmt::format("\xff\n\"{} {}", t, i));
      });
    for (std::thread& thread : threads) thread.join();
  });
  std::istringstream lines(text);
  std::set<std::string> messages;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json event = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(event.is_object()) << line;
    EXPECT_EQ(event["event"], "warning");
    messages.insert(event["message"]);
  }
  EXPECT_EQ(messages.size(), 400u);
  EXPECT_TRUE(messages.contains("\xEF\xBF\xBD\n\"3 99"));  // U+FFFD stands for what is no UTF-8
}

TEST_F(Log, TellsTheFrameAtWorkAndWritesNumbersWithSixDigits) {
  setLogFormat(LogFormat::Json);
  const std::string text = captured([] {
    setEventFrame(-7);
    logEvent("a", {{"seconds", 1.23456789}, {"nothing", std::nan("")}, {"stages", LogSeconds{{"sort", 0.5}}}}, "text");
    setEventFrame(std::nullopt);
    logFailure("b", {{"count", std::size_t{12345678}}});
  });
  const std::string first = text.substr(0, text.find('\n')), second = text.substr(text.find('\n') + 1);
  EXPECT_TRUE(contains(first, R"("event":"a","frame":-7,"seconds":1.23457,"nothing":null,"stages":{"sort":0.5}})"));
  EXPECT_TRUE(contains(second, R"("event":"b","count":12345678})"));
}

TEST_F(Log, KeepsOnlyFailuresWhereItIsQuiet) {
  setVerbosity(Verbosity::Quiet);
  for (const LogFormat format : {LogFormat::Text, LogFormat::Json}) {
    setLogFormat(format);
    EXPECT_EQ(captured([] {
                logEvent("a", {}, "text");
                logWarning("w");
                Progress progress("lighting", 10, "rays");
              }),
              "");
    EXPECT_TRUE(contains(captured([] { logError("it failed", 3); }), "it failed"));
  }
}

TEST_F(Log, TellsTheSecondsOfAStageThatEndsButNotOfOneThatFails) {
  setLogFormat(LogFormat::Json);
  EXPECT_TRUE(contains(captured([] { Progress progress("sort"); }), R"("event":"stage","stage":"sort","seconds":)"));
  EXPECT_EQ(captured([] {
              try {
                Progress progress("sort");
                throw std::runtime_error("");
              } catch (const std::runtime_error&) {
              }
            }),
            "");
  // One at a time: what a stage is made of is no stage of its own.
  const std::string text = captured([] {
    Progress outer("outer");
    Progress inner("inner");
  });
  EXPECT_TRUE(contains(text, "outer"));
  EXPECT_FALSE(contains(text, "inner"));
}

TEST(ShortNumbers, HaveThreeDigitsAndAPrefix) {
  EXPECT_EQ(shortCount(0), "0");
  EXPECT_EQ(shortCount(12.345), "12.3");
  EXPECT_EQ(shortCount(999.4), "999");
  EXPECT_EQ(shortCount(999.5), "1 k");
  EXPECT_EQ(shortCount(1.234e6), "1.23 M");
  EXPECT_EQ(shortCount(5e15), "5e+03 T");
  EXPECT_EQ(shortSeconds(0.04), "0.0 s");
  EXPECT_EQ(shortSeconds(59.94), "59.9 s");
  EXPECT_EQ(shortSeconds(59.96), "1:00 min");
  EXPECT_EQ(shortSeconds(3599.4), "59:59 min");
  EXPECT_EQ(shortSeconds(3723), "1:02:03 h");
}

// --- random -------------------------------------------------------------------------------------------------------

TEST(RandomBits, AreTheOnesOfSplitMix64) {
  // The published sequence of SplitMix64 from seed 1234567 (Vigna's splitmix64.c, as in Rosetta Code).
  const std::uint64_t step = 0x9e3779b97f4a7c15ull;
  EXPECT_EQ(mixBits(1234567), 6457827717110365317ull);
  EXPECT_EQ(mixBits(1234567 + step), 3203168211198807973ull);
  EXPECT_EQ(mixBits(1234567 + 2 * step), 9817491932198370423ull);
}

TEST(RandomBits, ReachTheWholeUnitIntervalButNeverOne) {
  EXPECT_EQ(uniformFloat(0), 0.0f);
  EXPECT_EQ(uniformDouble(0), 0.0);
  EXPECT_EQ(uniformFloat(~0ull), 1.0f - 0x1p-24f);
  EXPECT_EQ(uniformDouble(~0ull), 1.0 - 0x1p-53);
}

TEST(RandomBits, ChangeWithSeedItemAndDimension) {
  std::set<std::uint64_t> seen;
  for (std::uint64_t seed = 0; seed < 20; ++seed)
    for (std::uint64_t item = 0; item < 50; ++item)
      for (std::uint64_t dimension = 0; dimension < 20; ++dimension) seen.insert(hashBits(seed, item, dimension));
  EXPECT_EQ(seen.size(), 20'000u);  // a chance collision of 64 bits: 1e-11
}

TEST(RandomBits, FlipHalfTheOutputForEachInputBit) {
  for (int bit = 0; bit < 64; ++bit) {
    int flipped = 0;
    constexpr int kTrials = 1000;
    for (std::uint64_t i = 0; i < kTrials; ++i)
      flipped += __builtin_popcountll(hashBits(7, i * 977) ^ hashBits(7, (i * 977) ^ (1ull << bit)));
    // 64,000 coin flips: standard deviation 126, and 64 bits are tried: 5 standard deviations.
    EXPECT_NEAR(flipped, 32 * kTrials, 5 * 126.5) << bit;
  }
}

TEST(Random, GivesTheSameSequenceForTheSameSeedAndItem) {
  Random a(5, 3), b(5, 3), other(5, 4);
  bool differs = false;
  for (int i = 0; i < 10; ++i) {
    const std::uint64_t bits = a.bits();
    EXPECT_EQ(bits, b.bits());
    differs |= bits != other.bits();
  }
  EXPECT_TRUE(differs);
}

TEST(Random, IsUniform) {
  // χ² of 100 cells over 10⁵ numbers: mean 99, standard deviation √198 = 14.1; 5 of them.
  constexpr int kCells = 100, kCount = 100'000;
  std::vector<int> cells(kCells);
  Random random(11);
  for (int i = 0; i < kCount; ++i) ++cells[static_cast<std::size_t>(random.uniform() * kCells)];
  double chi2 = 0;
  for (const int n : cells) chi2 += std::pow(n - kCount / kCells, 2) * kCells / kCount;
  EXPECT_NEAR(chi2, kCells - 1, 5 * std::sqrt(2.0 * (kCells - 1)));
}

TEST(Random, UniformStaysInItsInterval) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const double value = random.uniform(-3, -2);
    EXPECT_GE(value, -3);
    EXPECT_LT(value, -2);
  }
}

TEST(Random, DirectionsAreUnitVectorsWithoutAPreferredOne) {
  constexpr int kCount = 100'000;
  Random random(1);
  dvec3 mean(0), squares(0);
  for (int i = 0; i < kCount; ++i) {
    const dvec3 d = random.direction();
    ASSERT_NEAR(glm::dot(d, d), 1, 1e-14);  // a few roundings of 2^-53
    mean += d;
    squares += d * d;
  }
  for (int axis = 0; axis < 3; ++axis) {
    // A component is uniform on [−1, 1]: variance 1/3, its square's 4/45. Five standard errors.
    EXPECT_NEAR(mean[axis] / kCount, 0, 5 * std::sqrt(1.0 / 3 / kCount));
    EXPECT_NEAR(squares[axis] / kCount, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / kCount));
  }
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  constexpr int kCount = 200'000;
  Random random(9);
  double sum = 0, squares = 0, fourths = 0;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.normal();
    ASSERT_TRUE(std::isfinite(x));
    sum += x;
    squares += x * x;
    fourths += x * x * x * x;
  }
  // Standard errors from the moments 1, 3, 105 of x², x⁴, x⁸: √(1/n), √(2/n), √(96/n). Five of them.
  EXPECT_NEAR(sum / kCount, 0, 5 * std::sqrt(1.0 / kCount));
  EXPECT_NEAR(squares / kCount, 1, 5 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(fourths / kCount, 3, 5 * std::sqrt(96.0 / kCount));
}

// --- SHA-256 ------------------------------------------------------------------------------------------------------

using Sha256 = InFolder;

TEST_F(Sha256, MatchesTheExamplesOfFips180) {
  const auto hash = [&](const std::string& bytes) {
    write(path("f"), bytes);
    return sha256OfFile(path("f"));
  };
  EXPECT_EQ(hash(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  // A million times "a", the long example.
  EXPECT_EQ(hash(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_F(Sha256, ReadsFilesOfSeveralBlocks) {
  std::string bytes(3'000'001, 'b');
  write(path("a"), bytes);
  write(path("same"), bytes);
  bytes[2'500'000] = 'c';
  write(path("other"), bytes);
  EXPECT_EQ(sha256OfFile(path("a")), sha256OfFile(path("same")));
  EXPECT_NE(sha256OfFile(path("a")), sha256OfFile(path("other")));
}

TEST_F(Sha256, RefusesWhatIsNoReadableFile) {
  EXPECT_TRUE(contains(messageOf<InputError>([&] { sha256OfFile(path("none")); }), "none: cannot read: "));
  EXPECT_TRUE(contains(messageOf<InputError>([&] { sha256OfFile(folder_.string()); }), "reading failed: "));
}

// --- loops, boxes, time -------------------------------------------------------------------------------------------

TEST(ParallelBlocks, AreTheSameForAnyNumberOfThreads) {
  for (const std::size_t count : {0u, 1u, 9u, 10u, 11u, 1000u}) {
    for (const unsigned threads : {1u, 2u, 5u}) {
      const ThreadLimit limit(threads);
      std::vector<std::atomic<int>> touched(count), begins(count + 1);
      parallelBlocks(count, 10, [&](std::size_t begin, std::size_t end) {
        EXPECT_LE(end - begin, 10u);
        EXPECT_EQ(begin % 10, 0u);
        ++begins[begin];
        for (std::size_t i = begin; i < end; ++i) ++touched[i];
      });
      for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(touched[i], 1);
        EXPECT_EQ(begins[i], i % 10 == 0 ? 1 : 0);
      }
    }
  }
}

TEST(SortIntoBins, KeepsTheOrderWithinEachBinForAnyNumberOfThreads) {
  for (const std::size_t count : {0, 1, 63, 64, 65, 10'000})
    for (const std::size_t bins : {1, 7, 300}) {
      // An input gives none, one or two items.
      const auto each = [&](std::size_t begin, std::size_t end, const auto& put) {
        for (std::size_t i = begin; i < end; ++i)
          for (std::size_t copy = 0; copy < i % 3; ++copy) put(hashBits(copy, i) % bins, 2 * i + copy);
      };
      std::vector<std::vector<std::size_t>> expected(bins);
      each(0, count, [&](std::size_t bin, std::size_t item) { expected[bin].push_back(item); });
      Binned<std::size_t> binned;
      for (const unsigned threads : {1u, 2u, 7u}) {
        const ThreadLimit limit(threads);
        sortIntoBins(count, bins, each, binned);
        ASSERT_EQ(binned.bins(), bins);
        for (std::size_t bin = 0; bin < bins; ++bin)
          ASSERT_EQ(std::vector<std::size_t>(binned.of(bin).begin(), binned.of(bin).end()), expected[bin]);
      }
    }
  const auto nothing = [](std::size_t, std::size_t, const auto&) {};
  EXPECT_TRUE(sortIntoBins<int>(10, 0, nothing).items.empty());
}

TEST(ThreadLimitTest, HoldsWhileItLives) {
  const unsigned before = threadCount();
  {
    const ThreadLimit limit(1);
    EXPECT_EQ(threadCount(), 1u);
  }
  EXPECT_EQ(threadCount(), before);
}

TEST(BoundsTest, StartEmptyAndHoldWhatIsAdded) {
  Bounds bounds;
  EXPECT_TRUE(bounds.empty());
  EXPECT_EQ(bounds.size(), vec3(0));
  bounds.add(vec3(1, 2, 3));
  EXPECT_FALSE(bounds.empty());
  EXPECT_EQ(bounds.size(), vec3(0));
  bounds.add(vec3(-1, 4, 3));
  EXPECT_EQ(bounds.lo, vec3(-1, 2, 3));
  EXPECT_EQ(bounds.hi, vec3(1, 4, 3));
  EXPECT_EQ(bounds.centre(), vec3(0, 3, 3));
  Bounds other;
  other.add(bounds);
  other.add(Bounds{});
  EXPECT_EQ(other.lo, bounds.lo);
  EXPECT_EQ(other.hi, bounds.hi);
  // Half of each: the sum of two coordinates near the largest float would be infinite.
  EXPECT_EQ((Bounds{vec3(3e38f), vec3(3e38f)}.centre()), vec3(3e38f));
}

TEST(TimerTest, CountsUpAndStartsAgainAtALap) {
  Timer timer;
  const double first = timer.seconds(), second = timer.seconds();
  EXPECT_GE(first, 0);
  EXPECT_GE(second, first);
  EXPECT_GE(timer.lap(), second);
}

}  // namespace
}  // namespace mote
