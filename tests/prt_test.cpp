// PRT 1.x: what the reader accepts and refuses.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/prt_reader.h"
#include "tests/support/opened_file.h"
#include "tests/support/prt_bytes.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

TEST(PrtReader, ReadsAHandMadeFileOfBothVersions) {
  for (const int version : {1, 2}) {
    PrtFile file;
    file.version = version;
    const std::vector<vec3> positions = positionsOf(file.bytes());
    ASSERT_EQ(positions.size(), 3u);
    EXPECT_EQ(positions[2], vec3(2, 2.25f, 2.5f));
  }
}

TEST(PrtReader, RefusesTruncationAtEveryByte) {
  const PrtFile file;
  const std::string whole = file.bytes();
  const std::size_t header = file.header().size();
  ASSERT_GT(header, 150u);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THROW(positionsOf(whole.substr(0, length)), InputError) << "cut at " << length << " of " << header;
}

TEST(PrtReader, SurvivesEveryFlippedBit) {
  const std::string whole = PrtFile().bytes();
  expectEveryFlippedBitSurvived(whole, whole.size() * kDeflateExpansion);  // reading finds out
}

TEST(PrtReader, RefusesTruncationAtFiftyPlacesOfTheBody) {
  PrtFile file;
  file.particles.clear();
  file.count = 5000;
  for (int i = 0; i < 4 * file.count; ++i) file.particles += raw(std::sin(static_cast<float>(i)));
  const std::string whole = file.bytes();
  const std::size_t header = file.header().size(), body = whole.size() - header;
  ASSERT_EQ(positionsOf(whole).size(), 5000u);
  for (std::size_t k = 1; k <= 50; ++k) {
    // The first places lie close behind the header, the last cut the checksum's last byte only.
    const std::size_t length = k <= 10 ? header + k : k > 40 ? whole.size() - (51 - k) : header + body * (k - 10) / 31;
    expectRefused([&] { positionsOf(whole.substr(0, length)); }, {"particle"});
  }
}

TEST(PrtReader, SaysWhichParticleATruncatedFileEndsAt) {
  PrtFile file;
  file.count = 4;  // one more than there are
  expectRefused(file, {"particle 3 of 4", "48 of 64 bytes", "zlib stream ends"});
}

TEST(PrtReader, RefusesTheThreeMalformedFilesOfItsMakersAtOnce) {
  const auto start = std::chrono::steady_clock::now();
  for (const char* name : {"massive_chunk_divisible", "massive_chunk_indivisible", "negative_eight"})
    expectRefused([&] { PrtReader(sharedFile(std::string("prt/") + name + ".prt")); }, {"'Metb'", "length"});
  // They once made readers loop for ever; two seconds are a thousand times what three headers need, on a busy machine
  // too.
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

TEST(PrtReader, ReadsTheMakersOwnFileWithItsMetadata) {
  const PrtReader reader(sharedFile("prt/prt_fractal_for_krscene.prt"));
  EXPECT_EQ(reader.count(), 312u);
  EXPECT_EQ(reader.header().minorVersion, 1);
  EXPECT_EQ(reader.header().particleBytes, 40u);
  EXPECT_EQ(describeChannels(reader.channels()),
            "Position (3 × float32), Color (3 × float32), Velocity (3 × float32), Density (float32)");
  ASSERT_EQ(reader.header().metadata.size(), 5u);
  ASSERT_NE(reader.header().meta("", "LengthUnitInMeters"), nullptr);
  EXPECT_EQ(reader.header().meta("", "LengthUnitInMeters")->bytes, raw(0.01));
  ASSERT_NE(reader.header().meta("Velocity", "Interpretation"), nullptr);
  EXPECT_EQ(reader.header().meta("Velocity", "Interpretation")->bytes, raw(std::int32_t{2}));

  std::vector<vec3> positions;
  const ChannelRequest request{"Position", &positions};
  reader.read({&request, 1});
  ASSERT_EQ(positions.size(), 312u);
  Bounds box;
  for (const vec3& p : positions) box.add(p);
  const std::string expected = reader.header().meta("", "BoundBox")->bytes;  // the makers' own figures
  EXPECT_EQ(expected, raw(box.lo.x) + raw(box.lo.y) + raw(box.lo.z) + raw(box.hi.x) + raw(box.hi.y) + raw(box.hi.z));
}

TEST(PrtReader, ReadsTheSmokeOf350000Particles) {
  const PrtReader reader(sharedFile("smoke1/smoke1_350k_power05.prt"));
  std::vector<vec3> positions;
  std::vector<float> density;
  const ChannelRequest requests[] = {{"Density", &density}, {"Position", &positions}};
  reader.read(requests);
  ASSERT_EQ(positions.size(), 350000u);
  ASSERT_EQ(density.size(), 350000u);
  EXPECT_NEAR(std::accumulate(density.begin(), density.end(), 0.0), 18518.5, 0.05);  // known to one decimal
  const auto [least, most] = std::minmax_element(density.begin(), density.end());
  EXPECT_NEAR(*least, 2.5e-4, 0.05e-4);  // known to two digits
  EXPECT_NEAR(*most, 0.19, 0.005);
}

TEST(PrtReader, RefusesWhatIsNoPrt1) {
  PrtFile file;
  file.magic[0] = 'X';
  expectRefused(file, {"PRT file", "XPRT"});
  file = {};
  file.signature = "Extensible Particle Formats";
  expectRefused(file, {"signature", "Formats"});
  file = {};
  file.version = 3;
  expectRefused(file, {"version", "got 3"});
  expectRefused([] { PrtReader(sharedFile("prt/wnormals.prt")); }, {"a PRT 1.0 or 1.1 file", "PRT 2"});
  expectRefused([] { PrtReader("/nowhere/at/all.prt"); }, {"/nowhere/at/all.prt", "No such file"});
  expectRefused([] { PrtReader("/tmp"); }, {"a folder"});
}

TEST(PrtReader, RefusesCountMinusOneAsNotClosed) {
  PrtFile file;
  file.count = -1;
  expectRefused(file, {"not closed correctly", "crashed or is still running"});
  file.count = -2;
  expectRefused(file, {"particle count", "-2"});
}

TEST(PrtReader, RefusesCountsThatTheFileCannotHoldWithoutAllocating) {
  for (const std::int64_t count : {std::int64_t{1'000'000'000'000'000}, std::numeric_limits<std::int64_t>::max(),
                                   std::numeric_limits<std::int64_t>::max() / 16 + 2}) {  // × 16 bytes wraps around 2⁶⁴
    PrtFile file;
    file.count = count;
    const TempFolder folder;
    writeBytes(folder.file("a.prt"), file.bytes());
    // In the constructor, before anything could be reserved.
    expectRefused([&] { PrtReader(folder.file("a.prt")); }, {"particle count", "1032", std::to_string(count)});
  }
}

TEST(PrtReader, ReservesNoMoreThanTheFilesBytesGive) {
  PrtFile file;
  file.body = deflated(file.particles);
  file.count = static_cast<std::int64_t>(file.body->size() * 1032 / 16);  // just possible, by the header's word
  const TempFolder folder;
  writeBytes(folder.file("a.prt"), file.bytes());
  std::vector<vec3> positions;
  const ChannelRequest request{"Position", &positions};
  const PrtReader reader(folder.file("a.prt"));
  expectRefused([&] { reader.read({&request, 1}); }, {"particle 3 of"});
  EXPECT_LT(positions.capacity(), 100u);
}

TEST(PrtReader, RefusesBadHeaderLengthsAndTables) {
  PrtFile file;
  file.version = 1;
  file.headerLengthChange = -1;
  expectRefused(file, {"header length", "at least 56", "55"});
  file.headerLengthChange = -60;
  expectRefused(file, {"header length", "-4"});
  file.headerLengthChange = 1'000'000;
  expectRefused(file, {"header length", "1000056"});
  file = {};
  file.reserved = 5;
  expectRefused(file, {"reserved", "expected 4, got 5"});
  file = {};
  file.recordLength = 43;
  expectRefused(file, {"record length", "44", "43"});
  file = {};
  file.channelCount = 0;
  expectRefused(file, {"channel count"});
  file.channelCount = std::numeric_limits<std::int32_t>::max();
  expectRefused(file, {"channel table", "2147483647 records"});
  file = {};
  file.channels.assign(5000, {"A", 1, 1, 0});
  expectRefused(file, {"channels", "at most 1024", "5000"});
}

TEST(PrtReader, SkipsWhatLongerRecordsAndHeadersAdd) {
  PrtFile file;
  file.recordLength = 60;
  EXPECT_EQ(positionsOf(file.bytes()).size(), 3u);
  // A 1.0 reader goes where the header's length says.
  file = {};
  file.version = 1;
  file.headerLengthChange = 10;
  std::string bytes = file.bytes();
  bytes.insert(56, 10, '?');
  EXPECT_EQ(positionsOf(bytes).size(), 3u);
}

TEST(PrtReader, RefusesBadChannels) {
  const auto with = [](std::vector<ChannelRecord> channels) {
    PrtFile file;
    file.channels = std::move(channels);
    return file;
  };
  expectRefused(with({{"Position", -1, 3, 0}}), {"'Position': type", "-1"});
  expectRefused(with({{"Position", 11, 3, 0}}), {"'Position': type", "11"});
  expectRefused(with({{"Position", 4, 0, 0}}), {"arity", "got 0"});
  expectRefused(with({{"Position", 4, -3, 0}}), {"arity", "-3"});
  expectRefused(with({{"Position", 5, std::numeric_limits<std::int32_t>::max(), 0}}), {"2147483647 × float64"});
  expectRefused(with({{"Position", 4, 3, -4}}), {"offset", "-4"});
  expectRefused(with({{"Position", 4, 3, 0}, {"Density", 4, 1, 8}}), {"overlap", "at least 12, the end of 'Position'"});
  expectRefused(with({{"Position", 4, 3, 0}, {"Position", 4, 1, 12}}), {"'Position' a second time"});
  expectRefused(with({{"Po sition", 4, 3, 0}}), {"'Po sition'"});
  expectRefused(with({{"0Position", 4, 3, 0}}), {"'0Position'"});
  expectRefused(with({{"", 4, 3, 0}}), {"channel 0: name"});
  expectRefused(with({{std::string(32, 'P'), 4, 3, 0}}), {"at most 31 characters"});
}

TEST(PrtReader, AcceptsChannelsInAnyOrderWithGaps) {
  PrtFile file;
  file.channels = {{"Density", 4, 1, 20}, {"Position", 4, 3, 4}};
  file.count = 2;
  file.particles = "gap!" + raw(1.0f) + raw(2.0f) + raw(3.0f) + "gap!" + raw(4.0f) + "gap!" + raw(5.0f) + raw(6.0f) +
                   raw(7.0f) + "gap!" + raw(8.0f);
  EXPECT_EQ(positionsOf(file.bytes()), (std::vector<vec3>{{1, 2, 3}, {5, 6, 7}}));
}

TEST(PrtReader, KeepsTextAndSequoiasDottedMetadata) {
  PrtFile file;
  file.chunks = meta("", "Author", -1, zeroTerminated("J. Doe")) +
                meta("", "Position.Interpretation", 1, raw(std::int32_t{1})) + chunk("Xtra", std::string(100, '?')) +
                chunk("Stop", "");
  const TempFolder folder;
  writeBytes(folder.file("a.prt"), file.bytes());
  const PrtReader reader(folder.file("a.prt"));
  ASSERT_NE(reader.header().meta("", "Author"), nullptr);
  EXPECT_EQ(reader.header().meta("", "Author")->bytes, "J. Doe");
  ASSERT_NE(reader.header().meta("Position", "Interpretation"), nullptr);
}

TEST(PrtReader, DropsMetadataOfUnknownChannelsWithAWarning) {
  takeWarnings();
  PrtFile file;
  file.chunks = meta("Spin", "Interpretation", 1, raw(std::int32_t{5})) + chunk("Stop", "");
  const TempFolder folder;
  writeBytes(folder.file("a.prt"), file.bytes());
  EXPECT_TRUE(PrtReader(folder.file("a.prt")).header().metadata.empty());
  EXPECT_TRUE(warned("'Interpretation' of 'Spin'"));
}

TEST(PrtReader, RefusesBadMetadata) {
  const auto with = [](const std::string& chunks) {
    PrtFile file;
    file.chunks = chunks;
    return file;
  };
  const std::string stop = chunk("Stop", "");
  expectRefused(with(""), {"Stop"});
  expectRefused(with(meta("", "A", 1, raw(1))), {"Stop"});
  expectRefused(with(chunk("Stop", "more")), {"'Stop'", "length of 0"});
  expectRefused(with(std::string("Meta") + raw(std::int32_t{-8}) + stop), {"'Meta'", "-8"});
  expectRefused(with(std::string("Meta") + raw(std::int32_t{0x7fffffff}) + stop), {"'Meta'", "2147483647"});
  expectRefused(with(meta("", "A", 5, "1234567") + stop), {"'A'", "multiple of 8 bytes", "7 bytes"});
  expectRefused(with(meta("", "A", 11, "12345678") + stop), {"'A'", "got 11"});
  expectRefused(with(meta("", "A", -1, "no zero") + stop), {"zero at its end"});
  expectRefused(with(meta("", "", 1, raw(1)) + stop), {"a name"});
  expectRefused(with(chunk("Meta", std::string(40, 'x')) + stop), {"at most 31 characters"});
  expectRefused(with(chunk("Meta", zeroTerminated("") + zeroTerminated("A") + "12") + stop), {"4 bytes", "2 bytes"});
  expectRefused(with(meta("Density", "Interpretation", 1, raw(std::int32_t{4})) + stop),
                {"Density.Interpretation", "arity 4"});
}

TEST(PrtReader, ReportsDamagedData) {
  PrtFile file;
  file.body = "this is not zlib's doing";
  expectRefused(file, {"zlib", "incorrect header check"});
  file.body = deflated(file.particles);
  file.body->back() ^= 1;
  expectRefused(file, {"incorrect data check"});
}

TEST(PrtReader, WarnsOfDataBehindTheLastParticle) {
  takeWarnings();
  PrtFile file;
  file.particles += "one float";
  EXPECT_EQ(positionsOf(file.bytes()).size(), 3u);
  EXPECT_TRUE(warned("behind the last"));
  file = {};
  EXPECT_EQ(positionsOf(file.bytes() + "trailing").size(), 3u);
  EXPECT_TRUE(warned("behind the last"));
  EXPECT_EQ(positionsOf(file.bytes()).size(), 3u);
  EXPECT_FALSE(warned("behind the last"));
}

TEST(PrtReader, AcceptsNoParticles) {
  PrtFile file;
  file.count = 0;
  file.particles.clear();
  EXPECT_TRUE(positionsOf(file.bytes()).empty());
  file.body = "";
  EXPECT_TRUE(positionsOf(file.bytes()).empty());
}

TEST(PrtReader, RefusesChannelsThatTheFileLacksOrThatDoNotFit) {
  const TempFolder folder;
  writeBytes(folder.file("a.prt"), PrtFile().bytes());
  const PrtReader reader(folder.file("a.prt"));
  std::vector<float> values;
  ChannelRequest request{"density", &values};
  expectRefused([&] { reader.read({&request, 1}); }, {"'density'", "it has Position (3 × float32), Density (float32)"});
  request.channel = "Position";
  expectRefused([&] { reader.read({&request, 1}); }, {"arity 1", "arity 3"});
}

}  // namespace
}  // namespace mote
