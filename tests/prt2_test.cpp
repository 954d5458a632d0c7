// PRT 2 and SPRT: what the reader accepts and refuses. Files are put together here byte by byte.
#include "host/particles/formats/prt2_reader.h"

#include <gtest/gtest.h>
#include <lz4.h>
#include <zlib.h>

#include <cstring>

#include "host/core/log.h"
#include "host/particles/particle_loader.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

std::string varint(std::uint64_t value) {
  std::string bytes;
  for (; value >= 128; value >>= 7) bytes += static_cast<char>((value & 127) | 128);
  bytes += static_cast<char>(value);
  return bytes;
}
std::string text(const std::string& value) {
  std::string bytes = varint(value.size());
  bytes += value;
  return bytes;
}
std::string chunk(const std::string& kind, const std::string& data) {
  std::string bytes = kind;
  bytes += rawNumbers<std::uint64_t>({data.size()}), bytes += data;
  return bytes;
}
std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  EXPECT_EQ(
      compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
      Z_OK);
  out.resize(size);
  return out;
}
std::string lz4(const std::string& bytes) {
  std::string out(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(bytes.size()))), '\0');
  const int size =
      LZ4_compress_default(bytes.data(), out.data(), static_cast<int>(bytes.size()), static_cast<int>(out.size()));
  EXPECT_GT(size, 0);
  out.resize(static_cast<std::size_t>(size));
  return out;
}
std::string transposed(const std::string& rows, std::size_t count) {
  std::string out(rows.size(), '\0');
  const std::size_t size = rows.size() / count;
  for (std::size_t j = 0; j < count; ++j)
    for (std::size_t k = 0; k < size; ++k) out[j + k * count] = rows[j * size + k];
  return out;
}

/// A PRT 2 file whose every field a test may spoil: three particles in blocks of two and one.
struct Prt2File {
  std::string magic = std::string("\xC0PRT2\r\n\x1a", 8);
  std::uint32_t version = 3;
  std::string channels =
      varint(2) + text("Position") + text("3 * float32") + varint(12) + text("ID") + text("uint16") + varint(2);
  std::string metadata = chunk("Meta", text("CoordSys") + text("int32") + rawNumbers<std::int32_t>({2})) +
                         chunk("Meta", text("Position.Interpretation") + text("string") + text("Point"));
  std::string stream, compression = "transpose-zlib", partKind = "Part";
  std::uint64_t particles = 3, blocks = 2;
  std::vector<std::string> rows{row(1, 10) + row(2, 20), row(3, 30)};
  bool index = true;
  std::uint64_t indexParticles = 0;  // beside what is true

  static std::string row(float x, std::uint16_t id) {
    return rawNumbers<float>({x, x + 1, x + 2}) + rawNumbers<std::uint16_t>({id});
  }
  std::string part(std::string& entries) const {
    std::string bytes = text(stream) + text(compression) + rawNumbers<std::uint64_t>({particles, blocks});
    for (const std::string& block : rows) {
      const std::size_t count = block.size() / 14;
      std::string data = compression.starts_with("transpose") ? transposed(block, count) : block;
      if (compression.ends_with("zlib")) data = deflated(data);
      if (compression.ends_with("lz4")) data = lz4(data);
      if (partKind == "PrtO") data.insert(0, rawNumbers<float>({1000, 2000, 3000}));
      bytes += rawNumbers<std::uint32_t>({static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(count)});
      bytes += data;
      entries += varint(data.size() + 8) + varint(count + indexParticles);
    }
    return bytes;
  }
  std::string bytes() const {
    std::string entries, file = magic;
    const std::string body = part(entries);
    file += rawNumbers<std::uint32_t>({version}), file += chunk("Chan", channels), file += metadata;
    file += chunk(partKind, body);
    if (index) file += chunk("PIdx", text(stream) + rawNumbers<std::uint64_t>({rows.size()}) + entries);
    return file;
  }
};

TEST(Prt2Reader, ReadsEveryCompression) {
  for (const char* compression : {"uncompressed", "zlib", "lz4", "transpose", "transpose-zlib", "transpose-lz4"}) {
    Prt2File file;
    file.compression = compression;
    const OpenedFile opened(file.bytes());
    EXPECT_EQ(opened.file->format(), "PRT 2");
    EXPECT_EQ(opened.file->count(), 3u);
    EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {2, 3, 4}, {3, 4, 5}})) << compression;
    EXPECT_EQ(opened.read<std::uint64_t>("ID"), (std::vector<std::uint64_t>{10, 20, 30})) << compression;
    ASSERT_NE(opened.file->meta("", "CoordSys"), nullptr);
    ASSERT_NE(opened.file->meta("Position", "Interpretation"), nullptr);
    EXPECT_EQ(opened.file->meta("Position", "Interpretation")->bytes, "Point");
  }
}

TEST(Prt2Reader, TakesBlocksWithoutParticles) {
  Prt2File file;
  file.compression = "uncompressed", file.blocks = 4;
  file.rows = {"", Prt2File::row(1, 10), "", Prt2File::row(2, 20) + Prt2File::row(3, 30)};
  for (const char* kind : {"Part", "PrtO"}) {
    file.partKind = kind;
    EXPECT_EQ(OpenedFile(file.bytes()).read<std::uint64_t>("ID"), (std::vector<std::uint64_t>{10, 20, 30}));
  }
}

TEST(Prt2Reader, AddsTheOffsetsOfBlocks) {
  Prt2File file;
  file.partKind = "PrtO", file.stream = "LOD0";
  const OpenedFile opened(file.bytes());
  EXPECT_EQ(opened.file->format(), "SPRT, LOD0");
  EXPECT_EQ(describeChannels(opened.file->channels()), "Position (3 × float64), ID (uint16)");
  EXPECT_EQ(opened.read<dvec3>("Position"),
            (std::vector<dvec3>{{1001, 2002, 3003}, {1002, 2003, 3004}, {1003, 2004, 3005}}));
  EXPECT_EQ(opened.read<std::uint64_t>("ID"), (std::vector<std::uint64_t>{10, 20, 30}));
}

TEST(Prt2Reader, ReadsTheStreamWithMostParticles) {
  Prt2File few, all;
  few.stream = "LOD1", few.particles = 1, few.blocks = 1, few.rows = {Prt2File::row(9, 90)};
  all.stream = "LOD0";
  std::string fewEntries, file = all.bytes();
  const std::string body = few.part(fewEntries);
  file += chunk("Part", body);
  file += chunk("PIdx", text("LOD1") + rawNumbers<std::uint64_t>({1}) + fewEntries);
  const OpenedFile opened(file);
  EXPECT_EQ(opened.file->format(), "SPRT, LOD0");
  EXPECT_EQ(opened.file->count(), 3u);
}

TEST(Prt2Reader, ReadsTheMakersOwnFiles) {
  const std::unique_ptr<ParticleFile> normals = openParticleFile(sharedFile("prt/wnormals.prt"));
  EXPECT_EQ(describeChannels(normals->channels()),
            "Position (3 × float32), Color (3 × float32), Normal (3 × float32), Intensity (float32)");
  std::vector<vec3> position;
  const ChannelRequest request{"Position", &position};
  normals->read({&request, 1});
  ASSERT_EQ(position.size(), 10u);  // bounds as the PROVENANCE has them
  EXPECT_EQ(position.front(), vec3(1, 1.1f, 1.2f));
  EXPECT_EQ(position.back(), vec3(10, 10.1f, 10.2f));

  const std::unique_ptr<ParticleFile> doubles = openParticleFile(sharedFile("prt/doubleFloat.prt"));
  std::vector<dvec3> far;
  const ChannelRequest farRequest{"Position", &far};
  doubles->read({&farRequest, 1});
  ASSERT_EQ(far.size(), 10u);
  const Metadata* extents = doubles->meta("Position", "Extents");  // near 1e14 and 1e15, to the last bit
  ASSERT_NE(extents, nullptr);
  ASSERT_EQ(extents->bytes.size(), 2 * sizeof(dvec3));
  EXPECT_EQ(std::memcmp(extents->bytes.data(), &far.front(), sizeof(dvec3)), 0);
  EXPECT_EQ(std::memcmp(extents->bytes.data() + sizeof(dvec3), &far.back(), sizeof(dvec3)), 0);
  EXPECT_NEAR(far.back().z, 1.02e15, 1);

  ParticleSource source;
  source.file = sharedFile("prt/noNormals.prt");
  EXPECT_EQ(loadParticles({source}, 1).size(), 10u);
}

TEST(Prt2Reader, RefusesTruncationAtEveryByte) {
  const std::string whole = Prt2File{}.bytes();
  for (std::size_t size = 0; size < whole.size(); ++size) expectFileRefused(whole.substr(0, size), {"particles"});
}

TEST(Prt2Reader, SurvivesEveryFlippedBit) {
  expectEveryFlippedBitSurvived(Prt2File{}.bytes(), 3000);
  Prt2File offsets;
  offsets.partKind = "PrtO", offsets.compression = "uncompressed";
  expectEveryFlippedBitSurvived(offsets.bytes(), 3);
  offsets.compression = "lz4";
  expectEveryFlippedBitSurvived(offsets.bytes(), 3000);
}

TEST(Prt2Reader, SaysWhatIsWrong) {
  const auto spoiled = [](const auto& spoil) {
    Prt2File file;
    spoil(file);
    return file.bytes();
  };
  expectFileRefused(spoiled([](Prt2File& f) { f.version = 4; }), {"version", "4"});
  expectFileRefused(spoiled([](Prt2File& f) { f.compression = "zip"; }), {"transpose-zlib", "'zip'"});
  expectFileRefused(spoiled([](Prt2File& f) { f.blocks = ~0ull; }), {"not closed"});
  expectFileRefused(spoiled([](Prt2File& f) { f.index = false; }), {"an index", "PIdx"});
  expectFileRefused(spoiled([](Prt2File& f) { f.indexParticles = 1; }), {"index of stream"});
  expectFileRefused(spoiled([](Prt2File& f) { f.blocks = 3; }), {"index of stream", "3 blocks"});
  expectFileRefused(spoiled([](Prt2File& f) { f.particles = 4; }), {"4 particles"});
  expectFileRefused(spoiled([](Prt2File& f) { f.channels = varint(1) + text("P") + text("half") + varint(2); }),
                    {"'P'", "'half'"});
  expectFileRefused(spoiled([](Prt2File& f) { f.channels = varint(1) + text("P") + text("2 * int8") + varint(3); }),
                    {"the 2 bytes of 2 * int8", "3"});
  expectFileRefused(spoiled([](Prt2File& f) { f.channels = varint(1) + text("P") + text("0 * int8") + varint(0); }),
                    {"'0 * int8'"});
  expectFileRefused(spoiled([](Prt2File& f) { f.channels = varint(0); }), {"at least one channel"});
  expectFileRefused(spoiled([](Prt2File& f) { f.channels.append(60000, 'x'); }), {"at most 50000"});
  expectFileRefused(spoiled([](Prt2File& f) { f.channels = std::string(11, '\xff'); }), {"ten bytes"});
  expectFileRefused(spoiled([](Prt2File& f) { f.metadata += chunk("Chan", f.channels); }), {"'Chan' first, once"});
}

TEST(Prt2Reader, LeavesUnknownChunksAndTypesOut) {
  takeWarnings();
  Prt2File file;
  file.metadata += chunk("What", "is this") + chunk("Meta", text("matrix") + text("16 * quad") + "x");
  EXPECT_EQ(OpenedFile(file.bytes()).file->count(), 3u);
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("'matrix'"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace mote
