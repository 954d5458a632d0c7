// Particles of one or more files as another file has them.
#include "host/particles/conversion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host/core/error.h"
#include "host/core/sampling.h"
#include "host/particles/particle_loader.h"
#include "tests/support/shared_data.h"
#include "tests/support/written_file.h"

namespace mote {
namespace {

using namespace test;

/// Writes inputs, converts them, keeps what came out.
struct Converted {
  TempFolder folder;
  ConversionReport report;
  std::unique_ptr<ParticleFile> file;

  Converted(const std::vector<std::vector<RawChannel>>& inputs, ConversionOptions options) {
    std::vector<std::unique_ptr<ParticleFile>> files;
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const std::string path = folder.file("in" + std::to_string(k));
      writeRaw(OutputFormat::Npy, path, inputs[k]);
      files.push_back(openParticleFile(path));
    }
    report = convertParticles(files, folder.file("out"), options);
    file = openParticleFile(folder.file("out"));
  }
};

RawChannel positions(std::vector<float> numbers) { return rawChannel("Position", NumberType::F32, 3, numbers); }

TEST(Conversion, KeepsEveryBitWhereTheTargetCanHoldIt) {
  std::vector<RawChannel> channels{anyNumbers("Position", NumberType::F32, 3, 5000)};
  for (const NumberType type : kAllTypes) channels.push_back(anyNumbers(std::string(numberName(type)), type, 2, 5000));
  for (const OutputFormat format : {OutputFormat::Prt1, OutputFormat::Prt2, OutputFormat::Csv, OutputFormat::Npy}) {
    const Converted converted({channels}, {.format = format});
    expectChannels(*converted.file, channels);
    for (const WrittenChannel& w : converted.report.channels) EXPECT_EQ(w.changed, 0u);
    EXPECT_EQ(converted.report.read, 5000u);
    EXPECT_EQ(converted.report.written, 5000u);
  }
}

TEST(Conversion, CountsWhatPlyCannotHold) {
  const Converted converted(
      {{positions({1, 2, 3, 4, 5, 6}), rawChannel<std::int64_t>("ID", NumberType::I64, 1, {9007199254740993, -3}),
        rawChannel<std::uint16_t>("Density", NumberType::F16, 1, {0x3c00, 0x2e66})}},
      {.format = OutputFormat::Ply});
  EXPECT_EQ(describeChannels(converted.file->channels()), "Position (3 × float32), ID (float64), Density (float32)");
  EXPECT_EQ(converted.report.channels[1].changed, 1u);
  EXPECT_EQ(converted.report.channels[2].changed, 0u);
  EXPECT_EQ(readNumbers<double>(*converted.file, "ID"), (std::vector<double>{9007199254740992, -3}));
  EXPECT_EQ(readNumbers<float>(*converted.file, "Density"), (std::vector<float>{1, 0.099975586f}));
}

TEST(Conversion, NarrowsPositionsForPrt1Only) {
  const std::vector<RawChannel> channels{rawChannel<double>("Position", NumberType::F64, 3, {1e15 + 1, 2, 3})};
  const Converted first({channels}, {.format = OutputFormat::Prt1}), second({channels}, {.format = OutputFormat::Prt2});
  EXPECT_EQ(first.file->channel("Position")->type, NumberType::F32);
  EXPECT_EQ(first.report.channels[0].changed, 1u);
  ASSERT_EQ(first.report.notes.size(), 1u);
  EXPECT_NE(first.report.notes[0].find("--format prt2"), std::string::npos);
  expectChannels(*second.file, channels);
}

TEST(Conversion, PutsInputsOneBehindTheOtherAndUnitesTheirChannels) {
  const std::vector<RawChannel> a{positions({1, 2, 3}), rawChannel<std::uint8_t>("n", NumberType::U8, 1, {200}),
                                  rawChannel<float>("Density", NumberType::F32, 1, {5})},
      b{rawChannel<double>("P", NumberType::F64, 3, {4, 5, 6.1, 7, 8, 9}),
        rawChannel<std::int8_t>("n", NumberType::I8, 1, {-3, 4}),
        rawChannel<float>("v", NumberType::F32, 3, {1, 2, 3, 4, 5, 6})};
  const Converted converted({a, b}, {.format = OutputFormat::Npy});
  EXPECT_EQ(describeChannels(converted.file->channels()),
            "Position (3 × float64), n (int16), Density (float32), Velocity (3 × float32)");
  EXPECT_EQ(readNumbers<dvec3>(*converted.file, "Position"), (std::vector<dvec3>{{1, 2, 3}, {4, 5, 6.1}, {7, 8, 9}}));
  EXPECT_EQ(readNumbers<double>(*converted.file, "n"), (std::vector<double>{200, -3, 4}));
  EXPECT_EQ(readNumbers<float>(*converted.file, "Density"), (std::vector<float>{5, 1, 1}));
  EXPECT_EQ(readNumbers<vec3>(*converted.file, "Velocity"), (std::vector<vec3>{vec3(0), {1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(converted.report.channels[2].filled, 2u);
  EXPECT_EQ(converted.report.channels[3].filled, 1u);
  EXPECT_EQ(converted.report.channels[3].from, "v");
}

TEST(Conversion, MakesUpNoRadiusAndNoId) {
  const std::vector<RawChannel> a{positions({1, 2, 3})};
  for (const char* name : {"Radius", "ID"}) {
    const std::vector<RawChannel> b{positions({1, 2, 3}), anyNumbers(name, NumberType::F32, 1, 1)};
    EXPECT_THROW(Converted({a, b}, {}), InputError);
    EXPECT_NO_THROW(Converted({a, b}, {.channels = {{"Position", ""}}}));
  }
}

TEST(Conversion, ChoosesRenamesAndCasts) {
  const std::vector<RawChannel> a{positions({1, 2, 3, 4, 5, 6}),
                                  rawChannel<float>("rho", NumberType::F32, 1, {0.1f, 2}),
                                  rawChannel<float>("pscale", NumberType::F32, 1, {7, 8})};
  const Converted converted({a}, {.format = OutputFormat::Npy,
                                  .channels = {{"Density", "rho"}, {"Radius", ""}, {"Position", ""}},
                                  .types = {{"Density", NumberType::F16}, {"Radius", NumberType::U8}}});
  EXPECT_EQ(describeChannels(converted.file->channels()), "Density (float16), Radius (uint8), Position (3 × float32)");
  EXPECT_EQ(readNumbers<float>(*converted.file, "Radius"), (std::vector<float>{7, 8}));
  EXPECT_EQ(converted.report.channels[0].changed, 1u) << "0.1 as half is another number";
  EXPECT_THROW(Converted({a}, {.channels = {{"Density", "roh"}}}), InputError);
  EXPECT_THROW(Converted({a}, {.types = {{"Densty", NumberType::F16}}}), InputError);
  const Converted kept({a}, {.format = OutputFormat::Npy, .keepNames = true});
  EXPECT_NE(kept.file->channel("pscale"), nullptr);
}

TEST(Conversion, GivesPrtNamesThatItCanHold) {
  const std::string longName(40, 'x');
  const std::vector<RawChannel> a{positions({1, 2, 3}), anyNumbers("a b", NumberType::U8, 1, 1),
                                  anyNumbers("a-b", NumberType::U8, 1, 1), anyNumbers("1st", NumberType::U8, 1, 1),
                                  anyNumbers(longName, NumberType::U8, 1, 1)};
  const Converted converted({a}, {.format = OutputFormat::Prt1});
  EXPECT_EQ(describeChannels(converted.file->channels()),
            "Position (3 × float32), a_b (uint8), a_b_2 (uint8), _1st (uint8), " + std::string(31, 'x') + " (uint8)");
}

TEST(Conversion, TakesTheSubSampleThatTheRendererTakes) {
  constexpr std::size_t kCount = 20'000;
  std::vector<std::uint64_t> ids(kCount);
  for (std::size_t i = 0; i < kCount; ++i) ids[i] = 3 * (kCount - i);
  const std::vector<RawChannel> byIndex{anyNumbers("Position", NumberType::F32, 3, kCount)},
      byId{byIndex[0], rawChannel("ID", NumberType::U64, 1, ids)};
  for (const std::vector<RawChannel>& input : {byIndex, byId}) {
    std::vector<std::byte> expected;
    for (std::size_t i = 0; i < kCount; ++i)
      if (isSampled(input.size() > 1 ? ids[i] : i, 7, 0.1f))
        expected.insert(expected.end(), input[0].bytes.begin() + static_cast<std::ptrdiff_t>(12 * i),
                        input[0].bytes.begin() + static_cast<std::ptrdiff_t>(12 * i + 12));
    // 2000 ± 5 √(0.09 · 20000)
    EXPECT_NEAR(static_cast<double>(expected.size()) / 12, 2000, 212);
    const Converted converted({input}, {.format = OutputFormat::Prt1, .subsample = 0.1f, .seed = 7});
    EXPECT_TRUE(readRaw(*converted.file, "Position") == expected);
    EXPECT_EQ(converted.report.read, kCount);
    EXPECT_EQ(converted.report.written, expected.size() / 12);
  }
  const std::vector<RawChannel> same{byIndex[0],
                                     rawChannel("ID", NumberType::U64, 1, std::vector<std::uint64_t>(kCount))};
  const Converted converted({same}, {.subsample = 0.1f});
  EXPECT_NEAR(static_cast<double>(converted.report.written), 2000, 212) << "an ID that all share chooses nothing";
  EXPECT_FALSE(converted.report.notes.empty());
}

TEST(Conversion, MovesParticlesAsAScenePutsThem) {
  const std::vector<RawChannel> a{positions({1, 2, 3, -4, 5.5f, 6}),
                                  rawChannel<float>("Radius", NumberType::F32, 1, {0.5f, 2}),
                                  rawChannel<float>("Density", NumberType::F32, 1, {3, 4}),
                                  rawChannel<float>("Velocity", NumberType::F32, 3, {1, 0, 0, 0, 2, 1}),
                                  rawChannel<float>("Normal", NumberType::F32, 3, {1, 0, 0, 0, 1, 0})};
  const Converted moved({a},
                        {.format = OutputFormat::Prt1, .scale = 2.5, .rotate = {10, 20, 30}, .translate = {1, -2, 3}});
  ParticleSource inScene;
  inScene.file = moved.folder.file("in0");
  inScene.scale = 2.5f, inScene.rotate = {10, 20, 30}, inScene.translate = {1, -2, 3};
  const ParticleSet set = loadParticles({inScene}, 1);
  EXPECT_EQ(readNumbers<vec3>(*moved.file, "Position"), set.position);
  EXPECT_EQ(readNumbers<vec3>(*moved.file, "Velocity"), set.velocity);
  EXPECT_EQ(readNumbers<float>(*moved.file, "Radius"), set.radius);
  EXPECT_EQ(readNumbers<float>(*moved.file, "Density"), (std::vector<float>{3, 4})) << "left as it is, with a note";
  EXPECT_EQ(moved.report.notes.size(), 1u);
  EXPECT_NEAR(glm::length(readNumbers<vec3>(*moved.file, "Normal")[0]), 1, 1e-6) << "rotated, not scaled";
}

TEST(Conversion, KeepsMetadataAndSaysWhichTheTargetCannotHold) {
  std::vector<std::unique_ptr<ParticleFile>> files;
  files.push_back(openParticleFile(sharedFile("prt/prt_fractal_for_krscene.prt")));
  const TempFolder folder;
  EXPECT_TRUE(convertParticles(files, folder.file("a.prt"), {}).lostMetadata.empty());
  const auto same = openParticleFile(folder.file("a.prt"));
  ASSERT_EQ(same->metadata().size(), files[0]->metadata().size());
  for (const Metadata& m : files[0]->metadata()) {
    ASSERT_NE(same->meta(m.channel, m.name), nullptr) << m.name;
    EXPECT_EQ(same->meta(m.channel, m.name)->bytes, m.bytes) << m.name;
  }
  const ConversionReport report = convertParticles(files, folder.file("a.npy"), {.format = OutputFormat::Npy});
  EXPECT_EQ(report.lostMetadata.size(), files[0]->metadata().size() - 1) << "all but the box, which is no loss";
}

TEST(Conversion, ReadsFormatsThatKeepOneChannelBehindTheOther) {
  std::vector<std::unique_ptr<ParticleFile>> files;
  files.push_back(openParticleFile(sharedFile("sph/bunny_frame_14_7705_particles.vtk")));
  const TempFolder folder;
  convertParticles(files, folder.file("a.npy"), {.format = OutputFormat::Npy, .keepNames = true});
  const auto copy = openParticleFile(folder.file("a.npy"));
  ASSERT_EQ(copy->count(), files[0]->count());
  for (const Channel& c : files[0]->channels())
    EXPECT_TRUE(readRaw(*copy, c.name) == readRaw(*files[0], c.name)) << c.name;
}

TEST(Conversion, LeavesNothingBehindWhereAnInputIsDamaged) {
  const TempFolder folder;
  writeRaw(OutputFormat::Prt1, folder.file("a.prt"), {anyNumbers("Position", NumberType::F32, 3, 200'000)});
  writeBytes(folder.file("a.prt"), readBytes(folder.file("a.prt")).substr(0, 1'000'000));
  std::vector<std::unique_ptr<ParticleFile>> files;
  files.push_back(openParticleFile(folder.file("a.prt")));
  EXPECT_THROW(convertParticles(files, folder.file("b.npy"), {.format = OutputFormat::Npy}), InputError);
  EXPECT_EQ(folder.entries(), std::vector<std::string>{"a.prt"});
}

}  // namespace
}  // namespace mote
