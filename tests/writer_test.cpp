// What is written in every format, read again by our readers.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/particles/formats/number_cast.h"
#include "tests/support/shared_data.h"
#include "tests/support/written_file.h"

namespace mote {
namespace {

using namespace test;

struct Target {
  OutputFormat format;
  const char* name;
  WriteOptions options;
};

const std::vector<Target>& targets() {
  static const std::vector<Target> all = [] {
    std::vector<Target> list{{OutputFormat::Prt1, "PRT 1.1", {}},
                             {OutputFormat::Ply, "PLY", {}},
                             {OutputFormat::Csv, "CSV", {}},
                             {OutputFormat::Npy, "NPY", {}},
                             {OutputFormat::Ply, "PLY, text", {}}};
    list.back().options.text = true;
    for (const char* kind : {"", "uncompressed", "zlib", "lz4", "transpose", "transpose-zlib", "transpose-lz4"}) {
      list.push_back({OutputFormat::Prt2, "PRT 2", {}});
      list.back().options.compression = kind;
    }
    return list;
  }();
  return all;
}

bool holds(OutputFormat format, NumberType type) {
  return format != OutputFormat::Ply || (type != NumberType::F16 && type != NumberType::I64 && type != NumberType::U64);
}

TEST(ParticleWriter, RoundTripsEveryTypeAndArityBitForBit) {
  constexpr std::size_t kCount = 300;
  for (const Target& target : targets())
    for (const NumberType type : kAllTypes) {
      if (!holds(target.format, type)) continue;
      std::vector<RawChannel> channels{anyNumbers("Position", NumberType::F32, 3, kCount)};
      for (const std::uint32_t arity : {1u, 2u, 3u, 4u, 16u})
        channels.push_back(anyNumbers("Value" + std::to_string(arity), type, arity, kCount));
      channels.push_back(anyNumbers("Velocity", type, 3, kCount));
      for (const RawChannel& c : channels)
        EXPECT_EQ(storedChannel(target.format, c.channel).type, c.channel.type) << target.name;
      const TempFolder folder;
      writeRaw(target.format, folder.file("a"), channels, target.options);
      SCOPED_TRACE(std::string(target.name) + " " + target.options.compression);
      expectChannels(*openParticleFile(folder.file("a")), channels);
    }
}

TEST(ParticleWriter, WritesTheSameBytesForAnyBlocksAndThreads) {
  // 4.8 MB: five pieces of PRT's, and more than one slice of the writer's.
  constexpr std::size_t kCount = 200'000;
  const std::vector<RawChannel> channels{anyNumbers("Position", NumberType::F32, 3, kCount),
                                         anyNumbers("Radius", NumberType::F32, 1, kCount),
                                         anyNumbers("ID", NumberType::U64, 1, kCount)};
  for (const Target& target : targets()) {
    if (!holds(target.format, NumberType::U64) || target.options.compression.ends_with("lz4")) continue;
    const TempFolder folder;
    writeRaw(target.format, folder.file("a"), channels, target.options);
    {
      const ThreadLimit one(1);
      writeRaw(target.format, folder.file("b"), channels, target.options, {}, 37'777);
    }
    EXPECT_TRUE(readBytes(folder.file("a")) == readBytes(folder.file("b"))) << target.name;
  }
}

TEST(ParticleWriter, WritesNoParticles) {
  for (const Target& target : targets()) {
    const std::vector<RawChannel> channels{anyNumbers("Position", NumberType::F32, 3, 0),
                                           anyNumbers("Density", NumberType::F32, 1, 0)};
    const TempFolder folder;
    writeRaw(target.format, folder.file("a"), channels, target.options);
    if (target.format == OutputFormat::Csv) {  // a header alone is any text
      EXPECT_EQ(readBytes(folder.file("a")), "float32 Position,float32 Position,float32 Position,float32 Density\n");
      continue;
    }
    EXPECT_EQ(openParticleFile(folder.file("a"))->count(), 0u) << target.name;
  }
}

TEST(ParticleWriter, LeavesNothingBehindWhenTheDiskIsFullOrItIsNotFinished) {
  const std::vector<RawChannel> channels{anyNumbers("Position", NumberType::F32, 3, 20'000)};
  for (const Target& target : targets()) {
    const TempFolder folder;
    {
      const auto writer =
          createParticleFile(target.format, folder.file("a"), {channels[0].channel}, {}, target.options);
      const std::span<const std::byte> column[] = {channels[0].bytes};
      writer->write(column);
    }
    EXPECT_TRUE(folder.entries().empty()) << target.name;
    // A limit on the size of files stands for the full disk: write() fails in the same way, with EFBIG for ENOSPC.
    rlimit old{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
    const auto oldHandler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{50'000, old.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    EXPECT_THROW(writeRaw(target.format, folder.file("a"), channels, target.options), MachineError) << target.name;
    setrlimit(RLIMIT_FSIZE, &old);
    std::signal(SIGXFSZ, oldHandler);
    EXPECT_TRUE(folder.entries().empty()) << target.name;
  }
}

TEST(PlyWriter, WidensWhatPlyHasNot) {
  EXPECT_EQ(storedChannel(OutputFormat::Ply, {"a", NumberType::F16}).type, NumberType::F32);
  EXPECT_EQ(storedChannel(OutputFormat::Ply, {"a", NumberType::I64}).type, NumberType::F64);
  EXPECT_EQ(storedChannel(OutputFormat::Ply, {"a", NumberType::U64}).type, NumberType::F64);
}

TEST(PlyWriter, KeepsSharesOfColoursAndNoOthers) {
  const Channel bytes{"Color", NumberType::U8, 3, 1.0 / 255}, numbers{"Color", NumberType::U8, 3},
      other{"Tint", NumberType::U8, 3, 1.0 / 255};
  EXPECT_EQ(storedChannel(OutputFormat::Ply, bytes).type, NumberType::U8);
  // A reader would take plain integers for shares of 255.
  EXPECT_EQ(storedChannel(OutputFormat::Ply, numbers).type, NumberType::F32);
  EXPECT_EQ(storedChannel(OutputFormat::Ply, other).type, NumberType::F32);
  EXPECT_EQ(storedChannel(OutputFormat::Npy, bytes).type, NumberType::F32);
  const TempFolder folder;
  const std::vector<RawChannel> channels{anyNumbers("Position", NumberType::F32, 3, 5),
                                         {bytes, std::vector<std::byte>(15, std::byte{51})}};
  writeRaw(OutputFormat::Ply, folder.file("a.ply"), channels);
  const auto file = openParticleFile(folder.file("a.ply"));
  EXPECT_EQ(readNumbers<vec3>(*file, "Color"), std::vector<vec3>(5, vec3(0.2f)));
}

TEST(PlyWriter, WritesAHeaderThatOtherProgramsKnow) {
  const TempFolder folder;
  const std::vector<RawChannel> channels{
      anyNumbers("Position", NumberType::F32, 3, 2), anyNumbers("Normal", NumberType::F64, 3, 2),
      anyNumbers("quality", NumberType::U8, 1, 2), anyNumbers("spin", NumberType::I16, 2, 2)};
  writeRaw(OutputFormat::Ply, folder.file("a.ply"), channels);
  const std::string bytes = readBytes(folder.file("a.ply"));
  EXPECT_EQ(bytes.substr(0, 40), "ply\nformat binary_little_endian 1.0\ncomm");
  EXPECT_NE(bytes.find("\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty double nx\n"
                       "property double ny\nproperty double nz\nproperty uchar quality\nproperty short spin[0]\n"
                       "property short spin[1]\nend_header\n"),
            std::string::npos)
      << bytes;
}

TEST(PlyWriter, RefusesPropertiesOfOneName) {
  const TempFolder folder;
  const std::vector<RawChannel> channels{anyNumbers("Position", NumberType::F32, 3, 2),
                                         anyNumbers("x", NumberType::U8, 1, 2)};
  EXPECT_THROW(writeRaw(OutputFormat::Ply, folder.file("a.ply"), channels), InputError);
  EXPECT_TRUE(folder.entries().empty());
}

TEST(CsvWriter, WritesKrakatoasHeaderAndTheShortestNumbers) {
  const TempFolder folder;
  const std::vector<RawChannel> channels{
      rawChannel<float>("Position", NumberType::F32, 3, {0.1f, -0.0f, 1e30f, 16777216, 1.0f / 3, -2.5f}),
      rawChannel<std::uint64_t>("ID", NumberType::U64, 1, {18446744073709551615ull, 9007199254740993ull}),
      rawChannel<std::uint16_t>("Density", NumberType::F16, 1, {0x3c00, 0x2e66})};
  writeRaw(OutputFormat::Csv, folder.file("a.csv"), channels);
  EXPECT_EQ(readBytes(folder.file("a.csv")),
            "float32 Position,float32 Position,float32 Position,uint64 ID,float16 Density\n"
            "0.1,-0,1e+30,18446744073709551615,1\n"
            "16777216,0.33333334,-2.5,9007199254740993,0.099975586\n");
  expectChannels(*openParticleFile(folder.file("a.csv")), channels);
}

TEST(CsvWriter, KeepsNotANumber) {
  const TempFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<RawChannel> channels{rawChannel<float>("Position", NumberType::F32, 3, {1, 2, 3, nan, -nan, 6})};
  for (const bool ply : {false, true}) {
    writeRaw(ply ? OutputFormat::Ply : OutputFormat::Csv, folder.file("a"), channels, {.text = ply});
    expectChannels(*openParticleFile(folder.file("a")), channels);
  }
}

TEST(NpyWriter, QuotesNamesAndAlignsTheData) {
  const TempFolder folder;
  const std::vector<RawChannel> channels{anyNumbers("it's \\ here", NumberType::F32, 3, 7),
                                         anyNumbers("größe", NumberType::I8, 1, 7)};
  writeRaw(OutputFormat::Npy, folder.file("a.npy"), channels);
  const auto file = openParticleFile(folder.file("a.npy"));
  EXPECT_EQ(file->format(), "NPY 3.0") << "a name is not ASCII";
  expectChannels(*file, channels);
  EXPECT_EQ((readBytes(folder.file("a.npy")).size() - 7 * 13) % 64, 0u);
}

TEST(PrtMetadata, IsCalledWhatEachOfTheFormatsCallsIt) {
  const std::vector<Channel> channels{{"Position", NumberType::F32, 3}};
  const std::vector<Metadata> first{
      Metadata::float64("", "LengthUnitInMeters", 0.01), Metadata::int32("", "CoordSys", 2),
      Metadata::int32("Position", "Interpretation", 1), Metadata::text("", "Author", "me")};
  std::vector<std::string> lost;
  const auto second = storedMetadata(OutputFormat::Prt2, first, channels, lost);
  ASSERT_EQ(second.size(), 4u);
  EXPECT_EQ(second[0].name, "LengthUnitInMicrometers");
  EXPECT_EQ(second[0].bytes, Metadata::float64("", "", 10000).bytes);
  EXPECT_EQ(second[2].bytes, "Point");
  const auto back = storedMetadata(OutputFormat::Prt1, second, channels, lost);
  ASSERT_EQ(back.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(back[k].name, first[k].name);
    EXPECT_EQ(back[k].type, first[k].type);
    EXPECT_EQ(back[k].bytes, first[k].bytes) << first[k].name;
  }
  EXPECT_TRUE(lost.empty());
  EXPECT_TRUE(storedMetadata(OutputFormat::Npy, first, channels, lost).empty());
  EXPECT_EQ(lost, (std::vector<std::string>{"LengthUnitInMeters", "CoordSys", "Position.Interpretation", "Author"}));
  lost.clear();
  storedMetadata(OutputFormat::Prt1, std::vector{Metadata::text("", std::string(32, 'x'), "long")}, channels, lost);
  EXPECT_EQ(lost.size(), 1u);
}

TEST(Prt2Writer, KeepsMetadataAndTheBoxOfItsPositions) {
  const TempFolder folder;
  const std::vector<RawChannel> channels{rawChannel<double>(
      "Position", NumberType::F64, 3, {1e15, 2, 3, -1, 5, std::numeric_limits<double>::quiet_NaN()})};
  const std::vector<Metadata> metadata{Metadata::text("", "Author", "me"),
                                       Metadata::text("Position", "Interpretation", "Point")};
  writeRaw(OutputFormat::Prt2, folder.file("a.prt"), channels, {}, metadata);
  const auto file = openParticleFile(folder.file("a.prt"));
  EXPECT_EQ(file->format(), "PRT 2");
  ASSERT_NE(file->meta("", "Author"), nullptr);
  EXPECT_EQ(file->meta("", "Author")->bytes, "me");
  ASSERT_NE(file->meta("Position", "Interpretation"), nullptr);
  ASSERT_NE(file->meta("Position", "Extents"), nullptr);
  double box[6];
  ASSERT_EQ(file->meta("Position", "Extents")->bytes.size(), sizeof box);
  std::memcpy(box, file->meta("Position", "Extents")->bytes.data(), sizeof box);
  EXPECT_EQ(std::vector<double>(box, box + 6), (std::vector<double>{-1, 2, 3, 1e15, 5, 3}));
}

TEST(Prt2Writer, RefusesACompressionThatThereIsNot) {
  const TempFolder folder;
  EXPECT_THROW(createParticleFile(OutputFormat::Prt2, folder.file("a.prt"), {{"a"}}, {}, {.compression = "gzip"}),
               InputError);
  EXPECT_THROW(createParticleFile(OutputFormat::Npy, folder.file("a.npy"), {{"a"}}, {}, {.compression = "zlib"}),
               InputError);
  EXPECT_THROW(createParticleFile(OutputFormat::Npy, folder.file("a.npy"), {{"a"}}, {}, {.text = true}), InputError);
  EXPECT_TRUE(folder.entries().empty());
}

TEST(OutputFormat, IsPickedByTheNamesEnd) {
  EXPECT_EQ(outputFormatOf("a/b.prt"), OutputFormat::Prt1);
  EXPECT_EQ(outputFormatOf("b.PLY"), OutputFormat::Ply);
  EXPECT_EQ(outputFormatOf("b.0001.csv"), OutputFormat::Csv);
  EXPECT_EQ(outputFormatOf("b.npy"), OutputFormat::Npy);
  EXPECT_THROW(outputFormatOf("b.bgeo"), InputError);
  EXPECT_THROW(outputFormatOf("b"), InputError);
  EXPECT_EQ(outputFormatNamed("prt2"), OutputFormat::Prt2);
  EXPECT_FALSE(outputFormatNamed("prt3"));
}

/// The same cloud, in every format that is written, is the same particles to the last bit: of the types that all of
/// them have. (same_cloud_test.cpp: those that are only read.)
TEST(FormatsTruth, OneCloudIsTheSameInEveryFormat) {
  const auto smoke = openParticleFile(sharedFile("smoke1/smoke1_350k_power05.prt"));
  constexpr std::size_t kCount = 5'000;
  std::vector<RawChannel> channels;
  for (const char* name : {"Position", "Density"}) {
    RawChannel raw{*smoke->channel(name), readRaw(*smoke, name)};
    raw.bytes.resize(kCount * raw.channel.bytes());
    channels.push_back(raw);
  }
  channels.push_back(anyNumbers("Velocity", NumberType::F64, 3, kCount));
  channels.push_back(anyNumbers("ID", NumberType::U32, 1, kCount));
  channels.push_back(anyNumbers("Color", NumberType::F32, 3, kCount));
  for (const Target& target : targets()) {
    SCOPED_TRACE(std::string(target.name) + " " + target.options.compression);
    const TempFolder folder;
    writeRaw(target.format, folder.file("a"), channels, target.options, {}, 1777);
    expectChannels(*openParticleFile(folder.file("a")), channels);
  }
}

TEST(NumberCast, CountsWhatIsNoLongerTheSameNumber) {
  const auto cast = [](NumberType from, const auto& numbers, NumberType to, auto zero) {
    std::vector<decltype(zero)> out(numbers.size());
    const std::uint64_t changed =
        castNumbers(from, std::as_bytes(std::span(numbers)), to, std::as_writable_bytes(std::span(out)));
    return std::pair(changed, out);
  };
  const std::vector<std::int64_t> whole{9007199254740993, 5, -7};
  EXPECT_EQ(cast(NumberType::I64, whole, NumberType::F64, double{}),
            std::pair(std::uint64_t{1}, std::vector<double>{9007199254740992, 5, -7}));
  const std::vector<float> floats{1.5f, 300, -1, std::numeric_limits<float>::quiet_NaN(), 255};
  EXPECT_EQ(cast(NumberType::F32, floats, NumberType::U8, std::uint8_t{}),
            std::pair(std::uint64_t{4}, std::vector<std::uint8_t>{2, 255, 0, 0, 255}));
  const std::vector<std::uint64_t> huge{~0ull, 1};
  EXPECT_EQ(cast(NumberType::U64, huge, NumberType::I32, std::int32_t{}),
            std::pair(std::uint64_t{1}, std::vector<std::int32_t>{2147483647, 1}));
  const std::vector<double> doubles{0.1, 0.5, 1e300};
  const auto [changed, narrowed] = cast(NumberType::F64, doubles, NumberType::F32, float{});
  EXPECT_EQ(changed, 2u);
  EXPECT_EQ(narrowed[0], 0.1f);
}

TEST(NumberCast, FindsTheSmallestTypeThatHoldsBoth) {
  using enum NumberType;
  EXPECT_EQ(commonType(F16, F32), F32);
  EXPECT_EQ(commonType(F64, F32), F64);
  EXPECT_EQ(commonType(U8, I8), I16);
  EXPECT_EQ(commonType(U8, I32), I32);
  EXPECT_EQ(commonType(U32, I32), I64);
  EXPECT_EQ(commonType(U64, I8), F64);
  EXPECT_EQ(commonType(U16, U32), U32);
  EXPECT_EQ(commonType(I16, F16), F32);
  EXPECT_EQ(commonType(I32, F32), F64);
  EXPECT_EQ(commonType(U8, F16), F16);
}

}  // namespace
}  // namespace mote
