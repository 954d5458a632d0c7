// PRT 1.x: what the writer gives back, by our own reader and by zlib.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include <Imath/half.h>

#include <cmath>
#include <csignal>
#include <cstring>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/particles/formats/prt_reader.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/support/prt_bytes.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

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
