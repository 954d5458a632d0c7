// What can be saved of files that were not closed, are cut off or damaged.
#include "host/particles/formats/salvage.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <set>

#include "host/core/error.h"
#include "tests/support/written_file.h"

namespace mote {
namespace {

using namespace test;

constexpr std::size_t kCount = 20;

std::vector<RawChannel> particles(std::size_t count = kCount) {
  return {anyNumbers("Position", NumberType::F32, 3, count), anyNumbers("ID", NumberType::U16, 1, count)};
}

std::string written(OutputFormat format, const std::vector<RawChannel>& channels, const WriteOptions& options = {}) {
  const TempFolder folder;
  writeRaw(format, folder.file("a.prt"), channels, options);
  return readBytes(folder.file("a.prt"));
}

constexpr std::size_t kRow = 14;

/// Where the particles of a PRT 1.x begin.
std::size_t bodyOf(const std::string& prt, std::size_t channels = 2) {
  std::int32_t header;
  std::memcpy(&header, prt.data() + 8, sizeof header);
  return static_cast<std::size_t>(header) + 12 + 44 * channels;
}

/// Bytes that zlib itself makes of the beginning of a stream.
std::size_t inflatedSize(const std::string& deflated) {
  z_stream stream{};
  EXPECT_EQ(inflateInit(&stream), Z_OK);
  std::string in = deflated, out(kCount * kRow + 1, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data()), stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data()), stream.avail_out = static_cast<uInt>(out.size());
  inflate(&stream, Z_SYNC_FLUSH);
  inflateEnd(&stream);
  return stream.total_out;
}

struct Saved {
  TempFolder folder;
  Salvaged salvaged;

  explicit Saved(const std::string& bytes) {
    writeBytes(folder.file("a.prt"), bytes);
    salvaged = salvageParticles(folder.file("a.prt"));
  }
  std::size_t count() const { return salvaged.file->count(); }
  const std::string& sentence() const { return salvaged.wrong.sentence; }
};

/// What is saved are the first particles, to the last bit.
void expectFirst(const Saved& saved, const std::vector<RawChannel>& all) {
  for (const RawChannel& raw : all) {
    const std::vector<std::byte> got = readRaw(*saved.salvaged.file, raw.channel.name);
    ASSERT_EQ(got.size(), saved.count() * raw.channel.bytes());
    EXPECT_TRUE(std::equal(got.begin(), got.end(), raw.bytes.begin())) << raw.channel.name;
  }
}

TEST(Salvage, SavesExactlyTheWholeParticlesOfAPrtCutAtEveryByte) {
  const std::vector<RawChannel> all = particles();
  const std::string whole = written(OutputFormat::Prt1, all);
  const std::size_t body = bodyOf(whole);
  std::size_t partial = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    if (size < body) {
      EXPECT_THROW(Saved(whole.substr(0, size)), InputError) << size;
      continue;
    }
    const Saved saved(whole.substr(0, size));
    ASSERT_EQ(saved.count(), inflatedSize(whole.substr(body, size - body)) / kRow) << "cut at " << size;
    EXPECT_FALSE(saved.sentence().empty()) << size;
    EXPECT_EQ(saved.salvaged.wrong.promised, kCount);
    expectFirst(saved, all);
    partial += saved.count() > 0 && saved.count() < kCount;
  }
  EXPECT_GT(partial, 50u) << "most cuts leave some particles";
  const Saved nothingWrong(whole);
  EXPECT_EQ(nothingWrong.count(), kCount);
  EXPECT_EQ(nothingWrong.sentence(), "");
}

TEST(Salvage, SavesAPrtThatWasNotClosedWholeOrCutAtEveryByte) {
  const std::vector<RawChannel> all = particles();
  std::string open = written(OutputFormat::Prt1, all);
  open.replace(48, 8, 8, '\xff');  // the count: −1
  const std::size_t body = bodyOf(open);
  for (std::size_t size = body; size <= open.size(); ++size) {
    const Saved saved(open.substr(0, size));
    ASSERT_EQ(saved.count(), inflatedSize(open.substr(body, size - body)) / kRow) << "cut at " << size;
    EXPECT_FALSE(saved.salvaged.wrong.promised);
    EXPECT_FALSE(saved.sentence().empty());
    expectFirst(saved, all);
  }
}

TEST(Salvage, SurvivesEveryFlippedBitOfAPrt) {
  const std::vector<RawChannel> all = particles(6);
  const std::string whole = written(OutputFormat::Prt1, all);
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string bytes = whole;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
    try {
      const Saved saved(bytes);
      EXPECT_LE(saved.count(), 6u * 1032) << bit;
      for (const Channel& channel : saved.salvaged.file->channels()) readRaw(*saved.salvaged.file, channel.name);
      // A few bits of a stream mean nothing; all others are noticed.
      if (bit >= 8 * bodyOf(whole) && saved.sentence().empty()) {
        EXPECT_EQ(saved.count(), 6u);
        expectFirst(saved, all);
      }
    } catch (const InputError&) {
      EXPECT_LT(bit, 8 * bodyOf(whole)) << "only the header can make it hopeless";
    }
  }
}

TEST(Salvage, SaysThatNumbersMayBeWrongWhereOnlyTheChecksumIs) {
  std::string bytes = written(OutputFormat::Prt1, particles());
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  const Saved saved(bytes);
  EXPECT_EQ(saved.count(), kCount);
  EXPECT_NE(saved.sentence().find("some numbers are not what was written"), std::string::npos) << saved.sentence();
}

TEST(Salvage, SavesMoreThanTheHeaderPromises) {
  std::string bytes = written(OutputFormat::Prt1, particles());
  bytes.replace(48, 8, std::string("\x07\0\0\0\0\0\0\0", 8));
  const Saved saved(bytes);
  EXPECT_EQ(saved.count(), kCount);
  EXPECT_EQ(saved.sentence(), "the header promises 7");
}

TEST(Salvage, SavesTheWholeBlocksOfAPrt2CutAtEveryByte) {
  // Rows of 64 KiB: sixteen of them are a block, so there are three.
  const std::size_t count = 40;
  const std::vector<RawChannel> all{anyNumbers("Position", NumberType::F32, 3, count),
                                    anyNumbers("Many", NumberType::U8, 65'524, count)};
  const std::string whole = written(OutputFormat::Prt2, all, {.compression = "lz4"});
  std::set<std::size_t> counts;
  for (std::size_t size = 120; size < whole.size(); size += 20011) {
    const Saved saved(whole.substr(0, size));
    counts.insert(saved.count());
    expectFirst(saved, all);
    if (saved.count() < count) {
      EXPECT_NE(saved.sentence(), "");
    }
  }
  EXPECT_EQ(counts, (std::set<std::size_t>{0, 16, 32}));
  EXPECT_EQ(Saved(whole.substr(0, whole.find("PIdx"))).count(), count);
}

TEST(Salvage, SavesAPrt2ThatWasNotClosedAndOneWithoutItsIndex) {
  const std::vector<RawChannel> all = particles();
  const std::string whole = written(OutputFormat::Prt2, all);
  const std::size_t part = whole.find("Part"), index = whole.find("PIdx");
  ASSERT_NE(index, whole.npos);
  std::string open = whole.substr(0, index);
  open.replace(part + 4, 8, 8, '\0');                                               // the chunk's size
  open.replace(part + 12 + 1 + 1 + std::strlen("transpose-zlib"), 16, 16, '\xff');  // its two counts
  const Saved saved(open);
  EXPECT_EQ(saved.count(), kCount);
  EXPECT_FALSE(saved.salvaged.wrong.promised);
  EXPECT_NE(saved.sentence().find("never written"), std::string::npos) << saved.sentence();
  expectFirst(saved, all);
  for (std::size_t size = part; size < whole.size(); ++size) {
    try {
      const Saved cut(whole.substr(0, size));
      EXPECT_EQ(cut.count(), size >= index ? kCount : 0) << size;
      expectFirst(cut, all);
    } catch (const InputError&) {
      EXPECT_LT(size, part + 12 + 32) << "the head of the particles is needed";
    }
  }
}

TEST(Salvage, SaysThatItSavesPrtOnly) {
  for (const char* bytes : {"", "ply\n", "x,y,z\n1,2,3\n"}) {
    try {
      const Saved saved((std::string(bytes)));
      ADD_FAILURE() << bytes;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("a PRT file, the only kind that is repaired"), std::string::npos);
    }
  }
}

TEST(Salvage, IsWhatReadersOfSuchFilesPointTo) {
  std::string open = written(OutputFormat::Prt1, particles()), cut = open.substr(0, open.size() - 20);
  open.replace(48, 8, 8, '\xff');
  const std::string second = written(OutputFormat::Prt2, particles());
  for (const std::string& bytes : {open, cut, second.substr(0, second.find("PIdx") - 1)}) {
    const TempFolder folder;
    writeBytes(folder.file("a.prt"), bytes);
    try {
      readRaw(*openParticleFile(folder.file("a.prt")), "ID");
      ADD_FAILURE();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("mote repair IN OUT"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace mote
