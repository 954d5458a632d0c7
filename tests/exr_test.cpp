// EXR files as they land on disk, and pictures that cannot be written, against hand-made ones.
#include <ImathBox.h>
#include <ImathMatrix.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <gtest/gtest.h>
#include <half.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/image/exr.h"
#include "host/image/png.h"
#include "tests/support/picture.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

// ---- EXR out and in ----

TEST(Exr, FloatComesBackBitForBitWithEveryCompression) {
  const TempFolder folder;
  for (const bool withDepth : {false, true}) {
    const Image image = noise(61, 43, withDepth);  // no multiple of any block height
    for (const ExrCompression compression : kCompressions) {
      const std::string path = folder.file("a.exr");
      writeExr(path, image, {.precision = ExrPrecision::Float, .compression = compression});
      const Image back = readExr(path);
      EXPECT_EQ(back.width, 61);
      EXPECT_EQ(back.height, 43);
      EXPECT_EQ(back.pixels, image.pixels) << int(compression);
      EXPECT_EQ(back.depth, image.depth) << int(compression);
    }
  }
}

TEST(Exr, HalfComesBackAsTheNearestHalfAndDepthAsFloat) {
  const TempFolder folder;
  const Image image = noise(61, 43, true);
  for (const ExrCompression compression : kCompressions) {
    const std::string path = folder.file("a.exr");
    writeExr(path, image, {.precision = ExrPrecision::Half, .compression = compression});
    const Image back = readExr(path);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      for (int c = 0; c < 4; ++c)
        // Rounding to nearest, 11 significant bits; below 2⁻¹⁴ the spacing stays 2⁻²⁴.
        ASSERT_NEAR(back.pixels[i][c], image.pixels[i][c], std::max(0x1p-11f * image.pixels[i][c], 0x1p-25f));
    EXPECT_EQ(back.depth, image.depth);
  }
  EXPECT_TRUE(takeWarnings().empty());
}

TEST(Exr, ChannelsHaveTheNamesAndTypesPromised) {
  const TempFolder folder;
  const auto channels = [&](ExrPrecision precision, bool withDepth) {
    writeExr(folder.file("a.exr"), noise(4, 4, withDepth), {.precision = precision});
    std::string text;
    for (const ExrChannel& c : exrChannels(folder.file("a.exr"))) text += c.name + ":" + c.type + " ";
    return text;
  };
  EXPECT_EQ(channels(ExrPrecision::Half, false), "A:half B:half G:half R:half ");
  EXPECT_EQ(channels(ExrPrecision::Half, true), "A:half B:half G:half R:half Z:float ");
  EXPECT_EQ(channels(ExrPrecision::Float, true), "A:float B:float G:float R:float Z:float ");
}

TEST(Exr, LayersComeBackUnderTheirNamesMeasuresAsFloat) {
  const TempFolder folder;
  const Image image = layered(12, 9);
  writeExr(folder.file("a.exr"), image, {.precision = ExrPrecision::Half});
  std::string text;
  for (const ExrChannel& c : exrChannels(folder.file("a.exr"))) text += c.name + ":" + c.type + " ";
  EXPECT_EQ(text,
            "A:half AB:half AG:half AR:half B:half G:half R:half Z:float light.key.R:half optical_depth:float "
            "shadow.key:float velocity.x:float velocity.y:float ");
  const Image back = readExr(folder.file("a.exr"));
  EXPECT_TRUE(back.alpha == image.alpha);
  EXPECT_TRUE(back.depth == image.depth);
  EXPECT_TRUE(back.opticalDepth == image.opticalDepth);
  EXPECT_TRUE(back.velocity == image.velocity);
  ASSERT_EQ(back.layers.size(), 2u);  // in the file's order, by name
  EXPECT_EQ(back.layers[0].name, "light.key.R");
  EXPECT_TRUE(back.layers[0].values == image.layers[0].values);
  EXPECT_EQ(back.layers[1].name, "shadow.key");
  EXPECT_TRUE(back.layers[1].values == image.layers[1].values);
}

TEST(Exr, HeaderCarriesCompressionMatricesRateFrameAspectAndStrings) {
  const TempFolder folder;
  ExrOptions options;
  options.compression = ExrCompression::Piz;
  // A translation by (5, 6, 7): for column vectors it stands in glm's last column, for OpenEXR's rows in the last row.
  mat4 move(1);
  move[3] = vec4(5, 6, 7, 1);
  mat4 ndc(0);
  for (int i = 0; i < 16; ++i) ndc[i / 4][i % 4] = static_cast<float>(i);
  options.worldToCamera = move, options.worldToNDC = ndc;
  options.framesPerSecond = 29.97, options.frame = 17, options.pixelAspectRatio = 1.5f;
  options.strings = {{"mote:stats", "{\"particles\": 3}"}, {"mote:version", "0.1.0"}, {"empty", ""}};
  writeExr(folder.file("a.exr"), noise(8, 6, false), options);

  Imf::InputFile file(folder.file("a.exr").c_str());
  const Imf::Header& header = file.header();
  EXPECT_EQ(header.compression(), Imf::PIZ_COMPRESSION);
  EXPECT_EQ(header.lineOrder(), Imf::INCREASING_Y);
  EXPECT_EQ(header.pixelAspectRatio(), 1.5f);
  EXPECT_EQ(Imf::framesPerSecond(header).n, 30000);
  EXPECT_EQ(Imf::framesPerSecond(header).d, 1001u);
  EXPECT_EQ(header.typedAttribute<Imf::IntAttribute>("frame").value(), 17);
  EXPECT_EQ(Imath::V3f(1, 2, 3) * Imf::worldToCamera(header), Imath::V3f(6, 8, 10));
  const Imath::M44f got = Imf::worldToNDC(header);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) EXPECT_EQ(got[i][j], float(4 * i + j));
  EXPECT_EQ(header.dataWindow(), Imath::Box2i({0, 0}, {7, 5}));
  EXPECT_EQ(header.displayWindow(), header.dataWindow());
  EXPECT_EQ(exrStrings(folder.file("a.exr")), options.strings);
}

TEST(Exr, SameInputGivesTheSameBytesWhateverTheNumberOfThreads) {
  const TempFolder folder;
  const Image image = noise(200, 150, true);
  for (const ExrCompression compression : kCompressions) {
    const auto bytes = [&](unsigned threads) {
      const ThreadLimit limit(threads);
      writeExr(folder.file("a.exr"), image, {.compression = compression, .strings = {{"b", "2"}, {"a", "1"}}});
      return readBytes(folder.file("a.exr"));
    };
    const std::string one = bytes(1);
    EXPECT_GT(one.size(), 1000u);
    EXPECT_TRUE(one == bytes(1)) << int(compression);
    EXPECT_TRUE(one == bytes(2)) << int(compression);
  }
}

TEST(Exr, HalfClampsWhatItCannotHoldAndWarnsOnceWithTheCount) {
  const TempFolder folder;
  Image image(3, 1, true);
  image.at(0, 0) = vec4(65504, -65504, 65505, 1e6f);
  image.at(1, 0) = vec4(kInfinity, -kInfinity, -7e4f, 1);
  image.at(2, 0) = vec4(kNan, 65504, 0, 1);
  image.depth = {1e9f, 2e9f, 3e9f};  // float: not clamped
  takeWarnings();
  setVerbosity(Verbosity::Quiet);
  writeExr(folder.file("a.exr"), image, {});
  setVerbosity(Verbosity::Normal);
  const auto warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_SAYS(warnings[0], "5 values");  // 65505, 1e6, ∞, −∞, −7e4
  EXPECT_SAYS(warnings[0], "65504");
  const Image back = readExr(folder.file("a.exr"));
  EXPECT_EQ(back.at(0, 0), vec4(65504, -65504, 65504, 65504));
  EXPECT_EQ(back.at(1, 0), vec4(65504, -65504, -65504, 1));
  EXPECT_TRUE(std::isnan(back.at(2, 0).x));
  EXPECT_EQ(back.depth, image.depth);
  writeExr(folder.file("b.exr"), image, {.precision = ExrPrecision::Float});
  EXPECT_TRUE(takeWarnings().empty());
  EXPECT_EQ(readExr(folder.file("b.exr")).at(1, 0), image.at(1, 0));
}

TEST(Exr, ReplacesAnOlderFileWhole) {
  const TempFolder folder;
  writeBytes(folder.file("a.exr"), std::string(100000, 'x'));
  writeExr(folder.file("a.exr"), noise(4, 4, false), {});
  EXPECT_EQ(readExr(folder.file("a.exr")).width, 4);
  EXPECT_EQ(folder.entries().size(), 1u);
}

// ---- EXR from elsewhere ----

/// A file of other makers: float channels `names`, every value 1 + its channel's place, with the windows given.
void writeForeign(const std::string& path, const std::vector<std::string>& names, const Imath::Box2i& data,
                  const Imath::Box2i& display, int sampling = 1) {
  Imf::Header header(display, data);
  const int width = data.max.x - data.min.x + 1, height = data.max.y - data.min.y + 1;
  std::vector<std::vector<float>> values;
  for (std::size_t i = 0; i < names.size(); ++i) values.emplace_back(std::size_t(width) * height, 1.0f + i);
  Imf::FrameBuffer buffer;
  for (std::size_t i = 0; i < names.size(); ++i) {
    header.channels().insert(names[i], Imf::Channel(Imf::FLOAT, sampling, sampling));
    buffer.insert(names[i], Imf::Slice::Make(Imf::FLOAT, values[i].data(), data, sizeof(float),
                                             sizeof(float) * width / sampling, sampling, sampling));
  }
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(buffer);
  file.writePixels(height);
}

const Imath::Box2i kFourByThree({0, 0}, {3, 2});

TEST(ReadExr, MissingChannelsHaveTheirDefaults) {
  const TempFolder folder;
  const auto first = [&](const std::vector<std::string>& names) {
    writeForeign(folder.file("a.exr"), names, kFourByThree, kFourByThree);
    return readExr(folder.file("a.exr")).at(3, 2);
  };
  EXPECT_EQ(first({"R", "G", "B"}), vec4(1, 2, 3, 1));
  EXPECT_EQ(first({"G"}), vec4(0, 1, 0, 1));
  EXPECT_EQ(first({"A"}), vec4(0, 0, 0, 1));
  EXPECT_EQ(first({"Y"}), vec4(1, 1, 1, 1));
  EXPECT_EQ(first({"A", "Y"}), vec4(2, 2, 2, 1));
  EXPECT_EQ(first({"Z", "other"}), vec4(0, 0, 0, 1));
  EXPECT_TRUE(readExr(folder.file("a.exr")).depth == std::vector<float>(12, 1.0f));
}

TEST(ReadExr, DataWindowIsPlacedInTheDisplayWindow) {
  const TempFolder folder;
  // The display is 4 × 3 at (10, −5); the data reach beyond it on the left and above, and leave its last column free.
  writeForeign(folder.file("a.exr"), {"R", "Z"}, Imath::Box2i({7, -8}, {12, -4}), Imath::Box2i({10, -5}, {13, -3}));
  const Image image = readExr(folder.file("a.exr"));
  ASSERT_EQ(image.width, 4);
  ASSERT_EQ(image.height, 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) {
      const bool inside = x < 3 && y < 2;
      EXPECT_EQ(image.at(x, y), inside ? vec4(1, 0, 0, 1) : vec4(0)) << x << ' ' << y;
      EXPECT_EQ(image.depth[4 * y + x], inside ? 2 : kNoDepth) << x << ' ' << y;
    }
}

TEST(ReadExr, LayersArePlacedInTheDisplayWindowToo) {
  const TempFolder folder;
  writeForeign(folder.file("a.exr"), {"R", "other", "velocity.x"}, Imath::Box2i({0, 0}, {1, 1}),
               Imath::Box2i({0, 0}, {3, 2}));
  const Image image = readExr(folder.file("a.exr"));
  ASSERT_EQ(image.layers.size(), 2u);  // velocity.x without velocity.y is a layer like any other
  EXPECT_EQ(image.layers[0].name, "other");
  EXPECT_EQ(image.layers[1].name, "velocity.x");
  ASSERT_EQ(image.layers[0].values.size(), 12u);
  EXPECT_EQ(image.layers[0].values[0], 2.0f);  // writeForeign numbers the channels from 1
  EXPECT_EQ(image.layers[0].values[2], 0.0f);  // right of the data
}

TEST(ReadExr, RejectsWhatItCannotReadWithPathAndReason) {
  const TempFolder folder;
  const std::string path = folder.file("a.exr");
  const auto message = [&] { return messageOf<InputError>([&] { readExr(path); }); };
  EXPECT_SAYS(message(), "a.exr: cannot read: No such file");
  writeBytes(path, "this is no picture at all");
  EXPECT_SAYS(message(), "a.exr: not a readable OpenEXR picture");
  writeForeign(path, {"U", "V"}, kFourByThree, kFourByThree);
  EXPECT_SAYS(message(), "at least one of R, G, B, A, Y, Z, got U, V");
  writeForeign(path, {"R"}, Imath::Box2i({0, 0}, {3, 3}), Imath::Box2i({0, 0}, {3, 3}), 2);
  EXPECT_SAYS(message(), "channel R: expected a sample for every pixel, got one for 2 × 2 pixels");
  writeForeign(path, {"R"}, kFourByThree, Imath::Box2i({0, 0}, {99999, 99999}));
  EXPECT_SAYS(message(), "displayWindow: expected at most 268435456 pixels, got 100000 × 100000");
  EXPECT_THROW(exrStrings(folder.file("none.exr")), InputError);
  EXPECT_THROW(exrChannels(folder.path()), InputError);
}

TEST(ReadExr, RejectsAFileCutAtAnyByte) {
  const TempFolder folder;
  const Image image = noise(9, 7, true);
  writeExr(folder.file("a.exr"), image, {.precision = ExrPrecision::Float, .compression = ExrCompression::Zips});
  const std::string bytes = readBytes(folder.file("a.exr"));
  ASSERT_GT(bytes.size(), 500u);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    writeBytes(folder.file("cut.exr"), bytes.substr(0, size));
    EXPECT_THROW(readExr(folder.file("cut.exr")), InputError) << "cut at " << size << " of " << bytes.size();
  }
}

// ---- where it cannot be written ----

using Writer = void (*)(const std::string&, const Image&);
struct NamedWriter {
  const char* name;
  Writer write;
};
const NamedWriter kWriters[] = {
    {"exr", [](const std::string& path, const Image& image) { writeExr(path, image, {}); }},
    {"png", [](const std::string& path, const Image& image) { writePng(path, image); }},
};

TEST(WritePicture, MissingFolderAndFolderAsTargetLeaveNothingBehind) {
  const TempFolder folder;
  const Image image = noise(8, 8, false);
  for (const NamedWriter& writer : kWriters) {
    const std::string missing = messageOf<InputError>([&] { writer.write(folder.file("no/a.exr"), image); });
    EXPECT_SAYS(missing, folder.file("no"));
    EXPECT_SAYS(messageOf<InputError>([&] { writer.write(folder.path(), image); }), "is a folder");
    writeBytes(folder.file("plain"), "x");
    EXPECT_SAYS(messageOf<InputError>([&] { writer.write(folder.file("plain/a.exr"), image); }), "not a folder");
    std::filesystem::remove(folder.file("plain"));
    EXPECT_TRUE(folder.entries().empty()) << writer.name;
  }
}

TEST(WritePicture, UnwritableFolderIsReportedAndLeftAsItWas) {
  const TempFolder folder;
  const Image image = noise(8, 8, false);
  if (::geteuid() == 0) {
    // Root may write anywhere, whatever the mode; /proc refuses even root.
    for (const NamedWriter& writer : kWriters)
      EXPECT_SAYS(messageOf<InputError>([&] { writer.write("/proc/a.exr", image); }), "cannot write there");
    return;
  }
  ASSERT_EQ(::chmod(folder.path().c_str(), 0500), 0);
  for (const NamedWriter& writer : kWriters)
    EXPECT_SAYS(messageOf<InputError>([&] { writer.write(folder.file("a.exr"), image); }), "cannot write there");
  EXPECT_TRUE(folder.entries().empty());
}

TEST(WritePicture, DiskFullAtAnyPointIsAMachineErrorAndLeavesNothingBehind) {
  const TempFolder folder;
  const Image image = noise(64, 48, true);
  for (const NamedWriter& writer : kWriters) {
    const std::string path = folder.file("a.exr");
    writer.write(path, image);
    const std::string whole = readBytes(path);
    const std::size_t size = whole.size();
    // In the header, in the middle, in the last buffer, one byte short (what OpenEXR itself would not notice).
    for (const std::size_t room : {std::size_t{0}, std::size_t{100}, size / 2, size - 5000, size - 1}) {
      for (const bool older : {false, true}) {
        std::filesystem::remove(path);
        if (older) writeBytes(path, "older");
        const std::string message = messageOf<MachineError>([&] {
          const FullDisk disk(room);
          writer.write(path, image);
        });
        EXPECT_SAYS(message, "a.exr: writing the picture failed after");
        EXPECT_SAYS(message, "bytes: File too large");
        EXPECT_EQ(folder.entries().size(), older ? 1u : 0u) << writer.name << " room " << room;
        if (older) {
          EXPECT_EQ(readBytes(path), "older");
        }
      }
    }
    const FullDisk disk(size);
    writer.write(path, image);  // exactly enough
    EXPECT_TRUE(readBytes(path) == whole) << writer.name;
  }
}

}  // namespace
}  // namespace mote
