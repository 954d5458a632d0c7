// PRT 1.x: what the reader accepts and refuses, and what the writer gives back. Files are put together here byte by
// byte, so that reader and writer are not only held against each other.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include <Imath/half.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/prt_reader.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::readBytes;
using test::sharedFile;
using test::TempFolder;
using test::writeBytes;

template <class T>
std::string raw(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

std::string zeroTerminated(const std::string& text) { return text + '\0'; }

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  EXPECT_EQ(compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                      bytes.size(), 6),
            Z_OK);
  out.resize(size);
  return out;
}

std::string chunk(const std::string& kind, const std::string& data) {
  return kind + raw(static_cast<std::int32_t>(data.size())) + data;
}

std::string meta(const std::string& channel, const std::string& name, std::int32_t type, const std::string& value) {
  return chunk("Meta", zeroTerminated(channel) + zeroTerminated(name) + raw(type) + value);
}

struct ChannelRecord {
  std::string name;
  std::int32_t type, arity, offset;
};

/// A PRT file whose every field a test may spoil.
struct PrtFile {
  std::string magic = std::string("\xC0PRT\r\n\x1a\n", 8);
  std::string signature = "Extensible Particle Format";
  std::int32_t version = 2;
  std::int64_t count = 3;
  std::string chunks = meta("", "LengthUnitInMeters", 5, raw(0.01)) + chunk("Stop", "");
  std::int32_t headerLengthChange = 0;
  std::int32_t reserved = 4, recordLength = 44;
  std::optional<std::int32_t> channelCount;
  std::vector<ChannelRecord> channels{{"Position", 4, 3, 0}, {"Density", 4, 1, 12}};
  std::string particles;            ///< not compressed
  std::optional<std::string> body;  ///< instead of the compressed particles

  PrtFile() {
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < 4; ++c) particles += raw(static_cast<float>(i + 0.25 * c));
  }
  std::string header() const {
    const std::string shown = version == 2 ? chunks : "";
    std::string out = magic + raw(static_cast<std::int32_t>(56 + static_cast<int>(shown.size()) + headerLengthChange));
    out += signature + std::string(32 - signature.size(), '\0') + raw(version) + raw(count) + shown;
    out += raw(reserved) + raw(channelCount.value_or(static_cast<std::int32_t>(channels.size()))) + raw(recordLength);
    for (const ChannelRecord& c : channels) {
      out += c.name + std::string(32 - c.name.size(), '\0') + raw(c.type) + raw(c.arity) + raw(c.offset);
      if (recordLength > 44) out += std::string(static_cast<std::size_t>(recordLength) - 44, 'x');
    }
    return out;
  }
  std::string bytes() const { return header() + body.value_or(deflated(particles)); }
};

/// Opens and reads Position of `bytes` as a file.
std::vector<vec3> positionsOf(const std::string& bytes) {
  const TempFolder folder;
  writeBytes(folder.file("a.prt"), bytes);
  const PrtReader reader(folder.file("a.prt"));
  std::vector<vec3> positions;
  const ChannelRequest request{"Position", &positions};
  reader.read({&request, 1});
  return positions;
}

/// The message of the InputError that `action` must throw, and the words that must stand in it.
void expectRefused(const std::function<void()>& action, const std::vector<std::string>& words) {
  try {
    action();
    ADD_FAILURE() << "nothing was thrown; expected a message with '" << (words.empty() ? "" : words[0]) << "'";
  } catch (const InputError& error) {
    for (const std::string& word : words)
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
          << "'" << word << "' is not in: " << error.what();
  }
}

void expectRefused(const PrtFile& file, const std::vector<std::string>& words) {
  expectRefused([&] { positionsOf(file.bytes()); }, words);
}

bool warned(const std::string& word) {
  for (const std::string& line : takeWarnings())
    if (line.find(word) != std::string::npos) return true;
  return false;
}

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
  test::expectEveryFlippedBitSurvived(whole, whole.size() * kDeflateExpansion);  // reading finds out
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
  expectRefused(file, {"channels", "at most 4096", "5000"});
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

template <class T>
T sample(int i) {
  return static_cast<T>(i * 7 % 100 - (std::is_signed_v<T> || !std::is_arithmetic_v<T> ? 50 : 0));
}

/// Writes `T` numbers of several arities as raw columns, reads them raw and converted.
template <class T>
void expectRoundTrip(NumberType type) {
  constexpr int kCount = 301;
  const TempFolder folder;
  std::vector<vec3> positions(kCount, vec3(1));
  for (const std::uint32_t arity : {1u, 2u, 3u, 4u, 16u}) {
    std::vector<T> values;
    for (int i = 0; i < kCount * static_cast<int>(arity); ++i) values.push_back(sample<T>(i));
    const std::span<const std::byte> bytes = std::as_bytes(std::span(values));
    const PrtColumn columns[] = {PrtColumn::raw("Value", type, arity, bytes), PrtColumn::of("Position", positions)};
    writePrt(folder.file("a.prt"), columns);
    const PrtReader reader(folder.file("a.prt"));
    ASSERT_NE(reader.header().channel("Value"), nullptr);
    EXPECT_EQ(reader.header().channel("Value")->type, type);
    EXPECT_EQ(reader.header().channel("Value")->arity, arity);

    std::vector<std::byte> back;
    std::vector<ChannelRequest> requests{{"Value", &back}};
    std::vector<vec3> vectors;
    std::vector<float> floats;
    std::vector<std::uint64_t> integers;
    if (arity != 2) requests.push_back({"Value", &vectors});
    if (arity == 1) requests.push_back({"Value", &floats}), requests.push_back({"Value", &integers});
    reader.read(requests);
    ASSERT_EQ(back.size(), bytes.size());
    EXPECT_EQ(std::memcmp(back.data(), bytes.data(), bytes.size()), 0) << numberName(type) << " × " << arity;
    for (std::size_t i = 0; i < vectors.size(); ++i)
      for (std::uint32_t c = 0; c < 3; ++c)  // whole numbers below 100 are exact in every type
        ASSERT_EQ(vectors[i][static_cast<int>(c)], static_cast<float>(values[i * arity + (arity == 1 ? 0 : c)]));
    for (std::size_t i = 0; i < floats.size(); ++i) ASSERT_EQ(floats[i], static_cast<float>(values[i]));
    for (std::size_t i = 0; i < integers.size(); ++i) {
      const auto number = static_cast<float>(values[i]);
      const bool cut = number < 0 && !std::is_integral_v<T>;
      ASSERT_EQ(integers[i], cut ? 0 : static_cast<std::uint64_t>(static_cast<std::int64_t>(number)));
    }
  }
}

TEST(PrtRoundTrip, EveryTypeAndArity) {
  expectRoundTrip<std::int8_t>(NumberType::I8);
  expectRoundTrip<std::uint8_t>(NumberType::U8);
  expectRoundTrip<std::int16_t>(NumberType::I16);
  expectRoundTrip<std::uint16_t>(NumberType::U16);
  expectRoundTrip<std::int32_t>(NumberType::I32);
  expectRoundTrip<std::uint32_t>(NumberType::U32);
  expectRoundTrip<std::int64_t>(NumberType::I64);
  expectRoundTrip<std::uint64_t>(NumberType::U64);
  expectRoundTrip<Imath::half>(NumberType::F16);
  expectRoundTrip<float>(NumberType::F32);
  expectRoundTrip<double>(NumberType::F64);
}

TEST(PrtRoundTrip, KeepsMetadataThroughWriterReaderWriter) {
  const TempFolder folder;
  const std::vector<vec3> positions{{1, 2, 3}, {-1, 5, 2}};
  const std::vector<float> density{1, 2};
  const PrtColumn columns[] = {PrtColumn::of("Position", positions), PrtColumn::of("Density", density)};
  const std::vector<Metadata> metadata{Metadata::float64("", "LengthUnitInMeters", 0.01),
                                       Metadata::int32("", "CoordSys", 1),
                                       Metadata::text("", "Author", "Jürgen"),
                                       Metadata::int32("Position", "Interpretation", 1),
                                       Metadata::float32s("Density", "Extents", {1, 2}),
                                       Metadata::text("Gone", "Note", "x")};
  writePrt(folder.file("a.prt"), columns, metadata);
  const PrtReader first(folder.file("a.prt"));
  EXPECT_EQ(first.header().metadata.size(), metadata.size());  // BoundBox came, Gone went
  for (std::size_t i = 0; i + 1 < metadata.size(); ++i) {
    const Metadata* found = first.header().meta(metadata[i].channel, metadata[i].name);
    ASSERT_NE(found, nullptr) << metadata[i].name;
    EXPECT_EQ(found->type, metadata[i].type);
    EXPECT_EQ(found->bytes, metadata[i].bytes);
  }
  const std::string box = first.header().meta("", "BoundBox")->bytes;
  EXPECT_EQ(box, raw(-1.0f) + raw(2.0f) + raw(2.0f) + raw(1.0f) + raw(5.0f) + raw(3.0f));
  writePrt(folder.file("b.prt"), columns, first.header().metadata);
  EXPECT_EQ(readBytes(folder.file("a.prt")), readBytes(folder.file("b.prt")));
}

TEST(PrtWriter, WritesOneValidZlibStreamForAnyNumberOfThreads) {
  const TempFolder folder;
  std::vector<vec3> positions(400'000);  // 4.8 MB: five pieces
  for (std::size_t i = 0; i < positions.size(); ++i)
    positions[i] = vec3(std::sin(0.1f * static_cast<float>(i)), i % 17, i);
  const PrtColumn column = PrtColumn::of("Position", positions);
  std::vector<std::string> files;
  for (const unsigned threads : {1u, 2u, 3u}) {
    const ThreadLimit limit(threads);
    writePrt(folder.file("a.prt"), {&column, 1});
    files.push_back(readBytes(folder.file("a.prt")));
  }
  EXPECT_EQ(files[0], files[1]);
  EXPECT_EQ(files[0], files[2]);
  // zlib itself, in one call, as any other reader would.
  std::int32_t header;
  std::memcpy(&header, files[0].data() + 8, 4);
  const std::size_t begin = static_cast<std::size_t>(header) + 12 + 44;
  std::vector<vec3> back(positions.size());
  uLongf size = back.size() * sizeof(vec3);
  ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(back.data()), &size,
                       reinterpret_cast<const Bytef*>(files[0].data()) + begin, files[0].size() - begin),
            Z_OK);
  EXPECT_EQ(size, positions.size() * sizeof(vec3));
  EXPECT_TRUE(back == positions);
}

TEST(PrtWriter, WritesVersion10AndNoParticles) {
  const TempFolder folder;
  const std::vector<vec3> positions{{1, 2, 3}}, none;
  PrtColumn column = PrtColumn::of("Position", positions);
  writePrt(folder.file("a.prt"), {&column, 1}, {}, {.minorVersion = 0});
  const PrtReader old(folder.file("a.prt"));
  EXPECT_EQ(old.header().minorVersion, 0);
  EXPECT_TRUE(old.header().metadata.empty());
  EXPECT_EQ(positionsOf(readBytes(folder.file("a.prt"))), positions);
  column = PrtColumn::of("Position", none);
  writePrt(folder.file("b.prt"), {&column, 1});
  EXPECT_TRUE(positionsOf(readBytes(folder.file("b.prt"))).empty());
}

TEST(PrtWriter, WritesEveryChannelThatASetHas) {
  ParticleSet set;
  set.position = {vec3(1, 2, 3), vec3(4, 5, 6)};
  set.radius = {0.5f, 1};
  set.density = {1, 2};
  const auto names = [&] {
    std::vector<std::string> list;
    for (const PrtColumn& column : columnsOf(set)) list.push_back(column.name);
    return list;
  };
  EXPECT_EQ(names(), (std::vector<std::string>{"Position", "Radius", "Density"}));
  set.color = set.velocity = {vec3(0), vec3(1)};
  set.absorption = {vec3(1, 2, 3), vec3(0)};
  set.emission = {vec3(0), vec3(7, 8, 9)};
  set.id = {3, 4};
  EXPECT_EQ(names(), (std::vector<std::string>{"Position", "Radius", "Density", "Color", "Absorption", "Emission",
                                               "Velocity", "ID"}));
  const TempFolder folder;
  writePrt(folder.file("a.prt"), columnsOf(set));
  std::vector<vec3> absorption, emission;
  const ChannelRequest requests[] = {{"Absorption", &absorption}, {"Emission", &emission}};
  PrtReader(folder.file("a.prt")).read(requests);
  EXPECT_EQ(absorption, set.absorption);
  EXPECT_EQ(emission, set.emission);
}

TEST(PrtWriter, LeavesNothingBehindWhenTheDiskIsFull) {
  const TempFolder folder;
  std::vector<vec3> positions(300'000);
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = vec3(std::sin(1.7f * static_cast<float>(i)));
  const PrtColumn column = PrtColumn::of("Position", positions);
  // A limit on the size of files stands for the full disk: write() fails in the same way, with EFBIG for ENOSPC.
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto oldHandler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{200'000, old.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string message;
  try {
    writePrt(folder.file("a.prt"), {&column, 1});
  } catch (const MachineError& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, oldHandler);
  EXPECT_NE(message.find("a.prt: writing failed after"), std::string::npos) << message;
  EXPECT_TRUE(folder.entries().empty());
}

TEST(PrtWriter, RefusesNamesThatPrtCannotHold) {
  const std::vector<vec3> positions{{1, 2, 3}};
  const TempFolder folder;
  const std::string longName = "Transmittance_" + std::string(18, 'x');  // 32 characters
  const PrtColumn columns[] = {PrtColumn::of("Position", positions), PrtColumn::of(longName, positions)};
  expectRefused([&] { writePrt(folder.file("a.prt"), columns); }, {longName, "channel name"});
  EXPECT_TRUE(folder.entries().empty());
}

TEST(PrtWriter, RefusesAMissingFolder) {
  const std::vector<vec3> positions{{1, 2, 3}};
  const PrtColumn column = PrtColumn::of("Position", positions);
  const TempFolder folder;
  expectRefused([&] { writePrt(folder.file("no/a.prt"), {&column, 1}); }, {"does not exist"});
}

}  // namespace
}  // namespace mote
