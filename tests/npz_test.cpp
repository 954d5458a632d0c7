// NPZ: what the reader accepts and refuses. Archives are put together here byte by byte.
#include "host/particles/formats/npz_reader.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include "host/core/log.h"
#include "host/particles/particle_loader.h"
#include "tests/support/npy_bytes.h"
#include "tests/support/opened_file.h"

namespace mote {
namespace {

using namespace test;

/// How a member is written.
struct Zipping {
  bool deflate = false;
  bool descriptor = false;        ///< sizes and checksum behind the data, zeros in front of them
  bool zip64 = false;             ///< sizes in an extra field, as numpy always has them in front of the data
  std::uint16_t method = 0xffff;  ///< said instead
  std::uint64_t saysBytes = 0;    ///< said instead of the unpacked size
  std::uint16_t flags = 0;
};
struct Member {
  std::string name, data;
  Zipping how = {};
};

std::string deflated(const std::string& bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string in = bytes, out(compressBound(bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data()), stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data()), stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string u16(std::uint64_t value) { return rawNumbers<std::uint16_t>({static_cast<std::uint16_t>(value)}); }
std::string u32(std::uint64_t value) { return rawNumbers<std::uint32_t>({static_cast<std::uint32_t>(value)}); }
std::string u64(std::uint64_t value) { return rawNumbers<std::uint64_t>({value}); }

/// APPNOTE.TXT, 4.3.7 and 4.3.12: what a local header and a directory's entry have alike, with its extra field.
struct Entry {
  std::string common, extra;

  Entry(const Member& m, std::size_t packed, bool local) {
    const Zipping& how = m.how;
    const bool later = how.descriptor && local;
    const std::uint64_t bytes = how.saysBytes ? how.saysBytes : m.data.size();
    const auto crc = crc32(0, reinterpret_cast<const Bytef*>(m.data.data()), static_cast<uInt>(m.data.size()));
    common = u16(how.zip64 ? 45 : 20) + u16(how.flags | (how.descriptor ? 8 : 0)) +
             u16(how.method != 0xffff ? how.method
                 : how.deflate        ? 8
                                      : 0) +
             u32(0x21 << 16);
    common += u32(later ? 0 : crc);
    common += how.zip64 ? u32(~0u) + u32(~0u) : u32(later ? 0 : packed) + u32(later ? 0 : bytes);
    if (how.zip64) extra = u16(1) + u16(16) + u64(later ? 0 : bytes) + u64(later ? 0 : packed);
    common += u16(m.name.size()) + u16(extra.size());
  }
};

std::string npz(const std::vector<Member>& members, std::uint64_t saysMembers = 0) {
  std::string file, directory;
  for (const Member& m : members) {
    const std::string data = m.how.deflate ? deflated(m.data) : m.data;
    const Entry local(m, data.size(), true), central(m, data.size(), false);
    directory += "PK\1\2" + u16(20) + central.common + u16(0) + u16(0) + u16(0) + u32(0) + u32(file.size());
    directory += m.name + central.extra;
    file += "PK\3\4" + local.common + m.name + local.extra + data;
    if (m.how.descriptor) file += "PK\7\10" + central.common.substr(10, 4) + u32(data.size()) + u32(m.data.size());
  }
  const std::uint64_t count = saysMembers ? saysMembers : members.size();
  return file + directory + "PK\5\6" + u32(0) + u16(count) + u16(count) + u32(directory.size()) + u32(file.size()) +
         u16(0);
}

const std::string kPlaces = npy(dictionary("'<f4'", "(2, 3)"), rawNumbers<float>({1, 2, 3, 4, 5, 6}));
std::string column(const std::string& type, const std::string& data, const char* shape = "(2,)") {
  return npy(dictionary("'" + type + "'", shape), data);
}
const std::string kRadii = column("<f8", rawNumbers<double>({0.5, 0.25}));

std::vector<std::string> warningsOf(const std::string& bytes) {
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  OpenedFile(bytes).readAll();
  return warnings;
}

TEST(NpzReader, ReadsArraysAsChannelsHoweverTheyArePacked) {
  for (const bool deflate : {false, true})
    for (const bool descriptor : {false, true})
      for (const bool zip64 : {false, true}) {
        if (descriptor && zip64) continue;  // the descriptor's sizes would be of eight bytes
        const Zipping how{deflate, descriptor, zip64};
        const OpenedFile opened(npz({{"pos.npy", kPlaces, how},
                                     {"pscale.npy", kRadii, how},
                                     {"id.npy", column(">i8", rawNumbers<std::int64_t>({7, 9}, true)), how}}));
        EXPECT_EQ(opened.file->format(), "NPZ");
        EXPECT_EQ(opened.file->count(), 2u);
        EXPECT_EQ(describeChannels(opened.file->channels()), "pos (3 × float32), pscale (float64), id (int64)");
        for (int again = 0; again < 2; ++again) {
          EXPECT_EQ(opened.read<vec3>("pos"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
          EXPECT_EQ(opened.read<float>("pscale"), (std::vector<float>{0.5, 0.25}));
          EXPECT_EQ(opened.read<std::uint64_t>("id"), (std::vector<std::uint64_t>{7, 9}));
        }
      }
}

TEST(NpzReader, JoinsArraysThatAreOneVectorByTheirNames) {
  const OpenedFile opened(npz({{"x.npy", column("<f4", rawNumbers<float>({1, 4}))},
                               {"y.npy", column(">f4", rawNumbers<float>({2, 5}, true)), {.deflate = true}},
                               {"z.npy", column("<f4", rawNumbers<float>({3, 6}))},
                               {"red.npy", column("|u1", std::string("\xff\0", 2))},
                               {"green.npy", column("|u1", std::string("\0\x33", 2))},
                               {"blue.npy", column("|u1", std::string("\0\xff", 2))}}));
  EXPECT_EQ(describeChannels(opened.file->channels()), "Position (3 × float32), Color (3 × uint8)");
  EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(opened.read<vec3>("Color"), (std::vector<vec3>{{1, 0, 0}, {0, 0.2f, 1}}));
}

TEST(NpzReader, ReadsFieldsAndColumnsInFortransOrder) {
  const std::string fields = npy(dictionary("[('P', '<f4', (3,)), ('id', '<u2')]", "(2,)"),
                                 rawNumbers<float>({1, 2, 3}) + u16(7) + rawNumbers<float>({4, 5, 6}) + u16(8));
  const std::string columns = npy(dictionary("'>f8'", "(2, 3)", "True"), rawNumbers<double>({1, 4, 2, 5, 3, 6}, true));
  const OpenedFile opened(npz({{"table.npy", fields}, {"v.npy", columns, {.deflate = true}}}));
  EXPECT_EQ(describeChannels(opened.file->channels()), "P (3 × float32), id (uint16), v (3 × float64)");
  EXPECT_EQ(opened.read<vec3>("P"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(opened.read<std::uint64_t>("id"), (std::vector<std::uint64_t>{7, 8}));
  EXPECT_EQ(opened.read<dvec3>("v"), (std::vector<dvec3>{{1, 2, 3}, {4, 5, 6}}));
}

TEST(NpzReader, ReadsASingleArrayWithoutANameAsAnNpyFile) {
  const std::string six = npy(dictionary("'<f4'", "(1, 6)"), rawNumbers<float>({1, 2, 3, 4, 5, 6}));
  const OpenedFile opened(npz({{"arr_0.npy", six}}));
  EXPECT_EQ(opened.read<vec3>("Velocity"), (std::vector<vec3>{{4, 5, 6}}));
}

TEST(NpzReader, TakesTheNumberOfParticlesFromThePositions) {
  // The first array is longer; P is a name of positions.
  const OpenedFile opened(npz(
      {{"table.npy",
        column("<f4", rawNumbers<float>({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18}), "(6, 3)")},
       {"P.npy", kPlaces}}));
  EXPECT_EQ(opened.file->count(), 2u);
  EXPECT_EQ(describeChannels(opened.file->channels()), "P (3 × float32)");
  ParticleSource source;
  source.file = opened.file->path();
  source.radius.kind = RadiusRule::Kind::Number, source.radius.value = 1;
  EXPECT_EQ(loadParticles({source}, 1).position, (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
}

TEST(NpzReader, KeepsScalarsAndShortArraysAsMetadata) {
  const std::string letters = rawNumbers<std::uint32_t>({'m', 0xb2, 0, 0, 0});  // m²
  const OpenedFile opened(npz({{"Position.npy", kPlaces},
                               {"time.npy", column(">f8", rawNumbers<double>({1.5}, true), "()")},
                               {"units.npy", column("<U5", letters, "()")},
                               {"note.npy", column("|S3", std::string("ab\0", 3), "()")},
                               {"box.npy", column("<i4", rawNumbers<std::int32_t>({1, 2, 3, 4, 5, 6}), "(3, 2)")}}));
  ASSERT_EQ(opened.file->metadata().size(), 4u);
  const Metadata* time = opened.file->meta("", "time");
  ASSERT_TRUE(time);
  EXPECT_EQ(time->type, static_cast<std::int32_t>(NumberType::F64));
  EXPECT_EQ(time->bytes, rawNumbers<double>({1.5}));
  EXPECT_EQ(opened.file->meta("", "units")->bytes, "m²");
  EXPECT_EQ(opened.file->meta("", "note")->bytes, "ab");
  EXPECT_EQ(opened.file->meta("", "box")->bytes, rawNumbers<std::int32_t>({1, 2, 3, 4, 5, 6}));
}

TEST(NpzReader, LeavesOutWhatIsNoParticlesAndSaysWhy) {
  const std::string pickle = npy(dictionary("'|O'", "(2,)"), "\x80\x04.");
  const std::string longer(4 * 17, '\0');
  const std::vector<std::string> warnings =
      warningsOf(npz({{"Position.npy", kPlaces},
                      {"objects.npy", pickle},
                      {"names.npy", column("<U1", rawNumbers<std::uint32_t>({'a', 'b'}))},
                      {"other.npy", column("<f4", longer, "(17,)")},
                      {"readme.txt", "hello"}}));
  ASSERT_EQ(warnings.size(), 1u);
  for (const char* words : {"'objects' (Python objects (pickle), which could run any program", "'names' (type '<U1')",
                            "'other' (17, where the particles are 2)", "'readme.txt' (no array"})
    EXPECT_NE(warnings[0].find(words), std::string::npos) << words << " is not in: " << warnings[0];
}

TEST(NpzReader, RefusesTruncationAtEveryByte) {
  const std::string whole = npz({{"Position.npy", kPlaces, {.deflate = true}}, {"Radius.npy", kRadii}});
  for (std::size_t size = 0; size < whole.size(); ++size) expectFileRefused(whole.substr(0, size), {"particles"});
}

TEST(NpzReader, SurvivesEveryFlippedBit) {
  expectEveryFlippedBitSurvived(
      npz({{"x.npy", column("<f4", rawNumbers<float>({1, 4})), {.deflate = true}}, {"P.npy", kPlaces}}), 24);
}

TEST(NpzReader, FindsDamagedNumbersByTheirChecksum) {
  for (const bool deflate : {false, true}) {
    std::string bytes = npz({{"P.npy", kPlaces, {.deflate = deflate}}});
    const std::size_t end = bytes.find("PK\1\2");
    bytes[end - 2] = static_cast<char>(bytes[end - 2] ^ 1);
    expectFileRefused(bytes, {"zip member 'P.npy'", "the file is damaged"});
  }
}

TEST(NpzReader, RefusesHostileNumbersWithoutAllocating) {
  for (const char* shape : {"(18446744073709551615, 3)", "(6148914691236517206, 3)", "(99999999999999999999, 3)",
                            "(4611686018427387904, 4)", "(3, 3)", "(1, 3)"})
    expectFileRefused(npz({{"P.npy", column("<f4", rawNumbers<float>({1, 2, 3, 4, 5, 6}), shape)}}), {"P.npy"});
  const std::uint64_t huge = std::uint64_t{1} << 40;
  expectFileRefused(npz({{"P.npy", kPlaces, {.deflate = true, .zip64 = true, .saysBytes = huge}}}),
                    {"zip member 'P.npy'", "1099511627776 bytes"});
  expectFileRefused(npz({{"P.npy", kPlaces, {.zip64 = true, .saysBytes = huge}}}), {"zip member 'P.npy'"});
  expectFileRefused(npz({{"P.npy", kPlaces}}, 65534), {"zip directory"});
  // A header that says to be a gigabyte long, which deflate could make of a megabyte, but not of these bytes.
  const std::string endless = std::string("\x93NUMPY\x02\x00", 8) + "\xff\xff\xff\x3f";
  expectFileRefused(npz({{"P.npy", endless + kPlaces}}), {"P.npy", "header length"});
}

TEST(NpzReader, RefusesMoreChannelsThanAnybodyLooksThrough) {
  expectFileRefused(npz({{"arr_0.npy", npy(dictionary("'|u1'", "(0, 1000000)"), "")}}),
                    {"arr_0", "channels", "at most 1024", "1000000"});
}

TEST(NpzReader, KeepsTheFirstOfTwoTextsOfOneName) {
  const OpenedFile opened(npz(
      {{"Position.npy", kPlaces}, {"note.npy", column("|S2", "ab", "()")}, {"note.npy", column("|S2", "cd", "()")}}));
  ASSERT_EQ(opened.file->metadata().size(), 1u);
  EXPECT_EQ(opened.file->meta("", "note")->bytes, "ab");
}

TEST(NpzReader, RefusesMembersThatShareTheirBytes) {
  // A directory that names one member many times: small files that unpack to many times what deflate can do.
  const std::string one = npz({{"P.npy", kPlaces}});
  const std::size_t begin = one.find("PK\1\2"), end = one.find("PK\5\6");
  std::string directory;
  for (int k = 0; k < 8; ++k) directory += one.substr(begin, end - begin);
  const std::string file = one.substr(0, begin) + directory + "PK\5\6" + u32(0) + u16(8) + u16(8) +
                           u32(directory.size()) + u32(begin) + u16(0);
  expectFileRefused(file, {"zip directory", "together"});
}

TEST(NpzReader, SaysWhatItDoesNotRead) {
  expectFileRefused(npz({{"P.npy", kPlaces, {.method = 12}}}), {"'P.npy'", "stored or deflated", "method 12"});
  expectFileRefused(npz({{"P.npy", kPlaces, {.flags = 1}}}), {"'P.npy'", "encrypted"});
  expectFileRefused(npz({{"a.npy", column("|O", "\x80\x04.")}}), {"positions", "'a' (2, type '|O')", "objects"});
  expectFileRefused(npz({{"a.npy", kRadii}}), {"N × 3", "'a' (2)"});
  expectFileRefused(npz({{"P.npy", npy(dictionary("'<f2'", "(1, 0)"), "")}}), {"N × 3", "'P' (1 × 0)"});
  expectFileRefused(npz({{"x.npy", npy(dictionary("'<f2'", "(1, 0)"), "")}}), {"N × 3", "'x' (1 × 0)"});
  expectFileRefused(npz({{"P.npy", kPlaces}, {"P.npy", kPlaces}}), {"different names", "'P' twice"});
  expectFileRefused(npz({{"P.npy", npy(dictionary("'<f4'", "(2, 3)"), "", 4)}}), {"'P.npy'", "NPY version", "4.0"});
}

}  // namespace
}  // namespace mote
