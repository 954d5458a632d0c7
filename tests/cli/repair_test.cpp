// mote repair, as a user meets it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/mote_program.h"
#include "tests/support/written_file.h"

namespace mote::test {
namespace {

constexpr std::size_t kCount = 1000;

std::vector<RawChannel> particles() {
  return {anyNumbers("Position", NumberType::F32, 3, kCount), anyNumbers("v", NumberType::F16, 3, kCount)};
}

/// Written, with metadata, and its bytes changed by `spoil`.
struct Spoilt {
  TempFolder folder;
  std::string in = folder.file("a.prt"), out = folder.file("b.prt");

  template <class Spoil>
  explicit Spoilt(const Spoil& spoil) {
    writeRaw(OutputFormat::Prt1, in, particles(), {}, {Metadata::int32("", "CoordSys", 2)});
    std::string bytes = readBytes(in);
    spoil(bytes);
    writeBytes(in, bytes);
  }
};

void open(std::string& bytes) { bytes.replace(48, 8, 8, '\xff'); }

TEST(MoteRepair, SavesAFileThatWasNotClosed) {
  const Spoilt file(open);
  EXPECT_EQ(mote({"info", file.in}).exitCode, 2);
  const ProcessResult result = mote({"repair", file.in, file.out});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "saved 1000 particles, of how many was never written"));
  const auto saved = openParticleFile(file.out);
  expectChannels(*saved, particles());  // under their own names
  EXPECT_NE(saved->meta("", "CoordSys"), nullptr);
}

TEST(MoteRepair, SavesWhatIsLeftOfAFileThatIsCutOff) {
  const Spoilt file([](std::string& bytes) { bytes.resize(bytes.size() / 2); });
  const ProcessResult result = mote({"repair", file.in, file.out});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.out, " of 1000 particles: the file ends within particle "));
  const auto saved = openParticleFile(file.out);
  EXPECT_GT(saved->count(), 300u);
  EXPECT_LT(saved->count(), 600u);
  const std::vector<std::byte> all = particles()[0].bytes, some = readRaw(*saved, "Position");
  EXPECT_TRUE(std::equal(some.begin(), some.end(), all.begin()));
  const ProcessResult again = mote({"repair", "--json", file.in, file.folder.file("c.npy")});
  const nlohmann::json report = nlohmann::json::parse(again.out);
  EXPECT_EQ(report["saved"], saved->count());
  EXPECT_EQ(report["promised"], 1000);
  EXPECT_EQ(report["output"]["format"], "NPY");
}

TEST(MoteRepair, SaysThatNothingIsWrong) {
  const Spoilt file([](std::string&) {});
  const ProcessResult result = mote({"repair", file.in, file.out});
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_TRUE(contains(result.out, "nothing is wrong with it, all 1000 particles are there"));
  expectChannels(*openParticleFile(file.out), particles());
}

TEST(MoteRepair, IsExitCode2WithASentenceWhereNothingCanBeSaved) {
  const Spoilt headerOnly(
      [](std::string&bytes) { open(bytes), bytes.resize(bytes.find("Stop") + 8 + 12 + 2 * 44 + 2); }),
      half([](std::string&bytes) { bytes.resize(60); });
  for (const Spoilt* file : {&headerOnly, &half}) {
    const ProcessResult result = mote({"repair", file->in, file->out});
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_TRUE(contains(result.err, "there is nothing to save"));
    EXPECT_EQ(file->folder.entries(), std::vector<std::string>{"a.prt"});
  }
}

TEST(MoteRepair, KeepsPrt2WhatItIs) {
  const TempFolder folder;
  writeRaw(OutputFormat::Prt2, folder.file("a.prt"), particles());
  const std::string bytes = readBytes(folder.file("a.prt"));
  writeBytes(folder.file("a.prt"), bytes.substr(0, bytes.find("PIdx")));
  const ProcessResult result = mote({"repair", folder.file("a.prt"), folder.file("b.prt")});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "PRT 2"));
  expectChannels(*openParticleFile(folder.file("b.prt")), particles());
}

TEST(MoteRepair, RefusesOtherFormatsItsInputAndFilesThatAreNot) {
  const TempFolder folder;
  writeRaw(OutputFormat::Ply, folder.file("a.ply"), {anyNumbers("Position", NumberType::F32, 3, 3)});
  writeRaw(OutputFormat::Prt1, folder.file("a.prt"), particles());
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{folder.file("a.ply"), folder.file("b.prt")}, "a PRT file, the only kind that is repaired"},
      {{folder.file("a.prt"), folder.file("a.prt")}, "never overwritten"},
      {{folder.file("c.prt"), folder.file("b.prt")}, "no such file"},
      {{folder.file("a.prt"), folder.file("b.xyz")}, "ends in .prt"}};
  for (const auto& [arguments, message] : cases) {
    const ProcessResult result = mote({"repair", arguments[0], arguments[1]});
    EXPECT_EQ(result.exitCode, 2) << message;
    EXPECT_TRUE(contains(result.err, message));
  }
  EXPECT_EQ(folder.entries().size(), 2u);
}

}  // namespace
}  // namespace mote::test
