// EXR and PNG files as they land on disk, and the numbers of a comparison, against hand-made pictures.
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
#include <png.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <limits>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/image/compare.h"
#include "host/image/exr.h"
#include "host/image/png.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::readBytes;
using test::TempFolder;
using test::writeBytes;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr ExrCompression kCompressions[] = {ExrCompression::None, ExrCompression::Rle, ExrCompression::Zips,
                                            ExrCompression::Zip, ExrCompression::Piz};

Image noise(int width, int height, bool withDepth) {
  Image image(width, height, withDepth);
  Random random(1);
  for (vec4& p : image.pixels)
    for (int c = 0; c < 4; ++c) p[c] = static_cast<float>(std::exp(random.uniform(-9, 6)));
  for (float& z : image.depth) z = random.uniform() < 0.1 ? kNoDepth : static_cast<float>(random.uniform(0.1, 5e4));
  return image;
}

/// Runs body, which must throw Exception, and returns its message.
template <class Exception, class Body>
std::string messageOf(const Body& body) {
  try {
    body();
  } catch (const Exception& e) {
    return e.what();
  } catch (const std::exception& e) {
    ADD_FAILURE() << "another exception: " << e.what();
    return {};
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

/// A disk that takes `bytes` and then no more: write() fails with EFBIG while this lives.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &limit_);
    const rlimit small{bytes, limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  void (*handler_)(int);
  rlimit limit_{};
};

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

/// A picture with every array that an Image may have, each number different.
Image layered(int width, int height) {
  Image image = noise(width, height, true);
  const std::size_t pixels = image.pixels.size();
  image.alpha.resize(pixels), image.opticalDepth.resize(pixels), image.velocity.resize(pixels);
  image.layers = {{"light.key.R", std::vector<float>(pixels), true}, {"shadow.key", std::vector<float>(pixels), false}};
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto n = static_cast<float>(i);
    image.alpha[i] = vec3(0.25f, 0.5f, 0.75f) + n;  // exact in half up to 512
    image.opticalDepth[i] = n + 0.1f;
    image.velocity[i] = vec2(n, -n - 0.3f);
    image.layers[0].values[i] = n / 2;
    image.layers[1].values[i] = n / 7;
  }
  return image;
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

// ---- PNG ----

struct Png {
  int width = 0, height = 0, channels = 0, bits = 0, intent = -1;
  std::vector<std::uint8_t> bytes;
};

Png readPng(const std::string& path) {
  Png out;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);  // aborts on an error
  png_infop info = png_create_info_struct(png);
  std::FILE* file = std::fopen(path.c_str(), "rb");
  EXPECT_NE(file, nullptr);
  if (!file) return out;
  png_init_io(png, file);
  png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  out.width = static_cast<int>(png_get_image_width(png, info));
  out.height = static_cast<int>(png_get_image_height(png, info));
  out.channels = png_get_channels(png, info);
  out.bits = png_get_bit_depth(png, info);
  png_get_sRGB(png, info, &out.intent);
  for (int y = 0; y < out.height; ++y) {
    const png_bytep row = png_get_rows(png, info)[y];
    out.bytes.insert(out.bytes.end(), row, row + out.width * out.channels);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  std::fclose(file);
  return out;
}

/// An RGBA file, straight alpha.
void writeRgbaPng(const std::string& path, const std::vector<std::uint8_t>& rgba, int width, int height) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width), png.height = static_cast<png_uint_32>(height);
  png.format = PNG_FORMAT_RGBA;
  ASSERT_TRUE(png_image_write_to_file(&png, path.c_str(), 0, rgba.data(), 0, nullptr));
}

TEST(Png, ReadsWhatItWroteAsLinearColour) {
  const TempFolder folder;
  Image image(3, 2);
  for (std::size_t i = 0; i < 6; ++i)
    image.pixels[i] = vec4(0.15f * static_cast<float>(i), 1, 0.0006f * static_cast<float>(i), 1);
  writePng(folder.file("a.png"), image);
  const Image read = readPng(folder.file("a.png"), PngValues::Color);
  ASSERT_EQ(read.width, 3);
  ASSERT_EQ(read.height, 2);
  for (std::size_t i = 0; i < 6; ++i)
    for (int c = 0; c < 4; ++c)  // half a code value; blue is in the linear part
      EXPECT_NEAR(read.pixels[i][c], image.pixels[i][c], c == 0 ? 0.0045f : 0.00016f) << i << ", " << c;
}

TEST(Png, ReadsDataAsItStandsAndAlphaApart) {
  const TempFolder folder;
  writeRgbaPng(folder.file("a.png"), {51, 102, 153, 204, 255, 0, 255, 0}, 1, 2);
  const Image read = readPng(folder.file("a.png"), PngValues::Data);
  ASSERT_EQ(read.pixels.size(), 2u);
  for (int c = 0; c < 4; ++c) EXPECT_FLOAT_EQ(read.pixels[0][c], 0.2f * static_cast<float>(c + 1));
  EXPECT_EQ(read.pixels[1], vec4(1, 0, 1, 0)) << "not premultiplied: a pixel of no opacity keeps its colour";
}

/// A grey or RGB file of one row, its numbers as they are; `gamma` 0: no gAMA chunk.
void writeRawPng(const std::string& path, int bits, int colorType, std::vector<std::uint8_t> row, double gamma) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);  // aborts on an error
  png_infop info = png_create_info_struct(png);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  ASSERT_NE(file, nullptr);
  png_init_io(png, file);
  const std::size_t pixelBytes = static_cast<std::size_t>(bits / 8) * (colorType == PNG_COLOR_TYPE_RGB ? 3 : 1);
  png_set_IHDR(png, info, static_cast<png_uint_32>(row.size() / pixelBytes), 1, bits, colorType, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (gamma > 0) png_set_gAMA(png, info, gamma);
  png_write_info(png, info);
  png_write_row(png, row.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

TEST(Png, TakesDataAsItStandsWhateverItsBitsAndGamma) {
  const TempFolder folder;
  for (const double gamma : {0.0, 1.0, 0.45455}) {
    // 0.2 and 0.8 of 255 and of 65535 (0x3333, 0xcccc), and a number that 8 bits do not hold.
    writeRawPng(folder.file("8.png"), 8, PNG_COLOR_TYPE_GRAY, {51, 204}, gamma);
    writeRawPng(folder.file("16.png"), 16, PNG_COLOR_TYPE_GRAY, {0x33, 0x33, 0xcc, 0xcc, 0x12, 0x34}, gamma);
    const Image eight = readPng(folder.file("8.png"), PngValues::Data);
    const Image sixteen = readPng(folder.file("16.png"), PngValues::Data);
    ASSERT_EQ(sixteen.pixels.size(), 3u);
    for (int c = 0; c < 3; ++c) {
      EXPECT_FLOAT_EQ(eight.pixels[0][c], 0.2f) << gamma;
      EXPECT_FLOAT_EQ(eight.pixels[1][c], 0.8f) << gamma;
      EXPECT_FLOAT_EQ(sixteen.pixels[0][c], 0.2f) << gamma;
      EXPECT_FLOAT_EQ(sixteen.pixels[1][c], 0.8f) << gamma;
      EXPECT_FLOAT_EQ(sixteen.pixels[2][c], 0x1234 / 65535.0f) << gamma;
    }
    EXPECT_EQ(sixteen.pixels[0].w, 1);
  }
}

TEST(Png, TakesColoursOf16BitsAsSrgb) {
  const TempFolder folder;
  writeRawPng(folder.file("8.png"), 8, PNG_COLOR_TYPE_RGB, {188, 51, 255}, 0);
  writeRawPng(folder.file("16.png"), 16, PNG_COLOR_TYPE_RGB, {188, 188, 51, 51, 255, 255}, 0);
  const Image eight = readPng(folder.file("8.png"), PngValues::Color);
  const Image sixteen = readPng(folder.file("16.png"), PngValues::Color);
  ASSERT_EQ(sixteen.pixels.size(), 1u);
  EXPECT_NEAR(sixteen.pixels[0].x, 0.5029, 1e-4);  // IEC 61966-2-1 of 188/255
  for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(sixteen.pixels[0][c], eight.pixels[0][c]);
}

TEST(Png, RefusesWhatIsNoWholePicture) {
  const TempFolder folder;
  EXPECT_THROW(readPng(folder.file("gone.png"), PngValues::Data), InputError);
  writeRgbaPng(folder.file("a.png"), std::vector<std::uint8_t>(4 * 64 * 64, 77), 64, 64);
  const std::string bytes = readBytes(folder.file("a.png"));
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{7}, std::size_t{20}, std::size_t{40}, bytes.size() / 2}) {
    writeBytes(folder.file("b.png"), bytes.substr(0, length));
    EXPECT_THROW(readPng(folder.file("b.png"), PngValues::Data), InputError) << length << " bytes";
  }
  std::string huge = bytes;  // a width of 65,536
  huge[16] = 0, huge[17] = 1, huge[18] = 0, huge[19] = 0;
  writeBytes(folder.file("b.png"), huge);
  EXPECT_THROW(readPng(folder.file("b.png"), PngValues::Data), InputError);
}

TEST(Srgb, IsTheInverseOfTheStandardsDecoding) {
  // IEC 61966-2-1 decodes code values; each must encode to itself, and the midpoints between must divide them.
  const auto decode = [](double code) {
    const double v = code / 255;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  for (int code = 0; code <= 255; ++code) {
    EXPECT_EQ(encodeSrgb(static_cast<float>(decode(code))), code);
    if (code < 255) {
      EXPECT_EQ(encodeSrgb(static_cast<float>(decode(code + 0.499))), code);
      EXPECT_EQ(encodeSrgb(static_cast<float>(decode(code + 0.501))), code + 1);
    }
  }
  EXPECT_EQ(encodeSrgb(-1), 0);
  EXPECT_EQ(encodeSrgb(7), 255);
  EXPECT_EQ(encodeSrgb(kInfinity), 255);
  EXPECT_EQ(encodeSrgb(kNan), 0);
}

TEST(Png, IsEightBitRgbMarkedAsSrgbWithRowsFromTheTop) {
  const TempFolder folder;
  Image image(3, 2);
  image.at(0, 0) = vec4(1, 0, 0, 1);
  image.at(2, 1) = vec4(0, 0.25f, 2, 0.1f);  // premultiplied over black: alpha does not matter
  writePng(folder.file("a.png"), image);
  const Png png = readPng(folder.file("a.png"));
  EXPECT_EQ(png.width, 3);
  EXPECT_EQ(png.height, 2);
  EXPECT_EQ(png.channels, 3);
  EXPECT_EQ(png.bits, 8);
  EXPECT_GE(png.intent, 0);  // the sRGB chunk is there
  std::vector<std::uint8_t> expected(18, 0);
  expected[0] = 255;
  expected[16] = 137, expected[17] = 255;  // sRGB of ¼ is 136.96
  EXPECT_EQ(png.bytes, expected);
}

TEST(Png, ExposureCountsInStops) {
  const TempFolder folder;
  Image image(1, 1);
  image.at(0, 0) = vec4(0.125f, 0.0625f, 0.5f, 1);
  writePng(folder.file("a.png"), image, 1);
  EXPECT_EQ(readPng(folder.file("a.png")).bytes, (std::vector<std::uint8_t>{137, 99, 255}));  // ¼, ⅛ (99.3), 1
  writePng(folder.file("a.png"), image, -1);
  EXPECT_EQ(readPng(folder.file("a.png")).bytes[2], 137);
}

TEST(Png, SameInputGivesTheSameBytes) {
  const TempFolder folder;
  const Image image = noise(70, 50, false);
  writePng(folder.file("a.png"), image);
  const ThreadLimit limit(1);
  writePng(folder.file("b.png"), image);
  EXPECT_TRUE(readBytes(folder.file("a.png")) == readBytes(folder.file("b.png")));
}

// ---- comparison ----

TEST(Compare, NumbersOfAHandMadePair) {
  Image a(4, 2), b(4, 2);
  b.at(1, 0) = vec4(0.3f, 0, 0, 0);
  b.at(3, 1) = vec4(0, -0.4f, 0, 0.005f);
  b.at(2, 1) = vec4(0.007f, 0, 0, 0);  // within 2/255 = 0.00784
  const ImageDifference d = compareImages(a, b);
  // Values are float: 1e-7 relative.
  EXPECT_NEAR(d.channel[0].rmse, std::sqrt((0.09 + 0.000049) / 8), 1e-7);
  EXPECT_NEAR(d.channel[0].mean, 0.307 / 8, 1e-7);
  EXPECT_NEAR(d.channel[0].max, 0.3, 1e-7);
  EXPECT_EQ(d.channel[0].maxX, 1);
  EXPECT_EQ(d.channel[0].maxY, 0);
  EXPECT_NEAR(d.channel[1].rmse, std::sqrt(0.16 / 8), 1e-7);
  EXPECT_EQ(d.channel[2].rmse, 0);
  EXPECT_NEAR(d.channel[3].max, 0.005, 1e-7);
  EXPECT_NEAR(d.overall.rmse, std::sqrt((0.09 + 0.000049 + 0.16 + 0.000025) / 32), 1e-7);
  EXPECT_NEAR(d.overall.mean, (0.3 + 0.007 + 0.4 + 0.005) / 32, 1e-7);
  EXPECT_NEAR(d.overall.max, 0.4, 1e-7);
  EXPECT_EQ(d.overall.maxX, 3);
  EXPECT_EQ(d.overall.maxY, 1);
  EXPECT_DOUBLE_EQ(d.within, 6.0 / 8);
  EXPECT_NEAR(d.psnr, -10 * std::log10(0.250074 / 32), 1e-5);
}

TEST(Compare, EqualPicturesHaveNoDifference) {
  const Image image = noise(20, 10, false);
  const ImageDifference d = compareImages(image, image);
  EXPECT_EQ(d.overall.rmse, 0);
  EXPECT_EQ(d.overall.max, 0);
  EXPECT_EQ(d.within, 1);
  EXPECT_EQ(d.psnr, std::numeric_limits<double>::infinity());
  EXPECT_SAYS(differenceJson(d), "\"psnr\": null");
}

TEST(Compare, EveryChannelCountsForWithin) {
  for (int channel = 0; channel < 4; ++channel) {
    Image a(2, 1), b(2, 1);
    b.at(0, 0)[channel] = 0.0079f;
    EXPECT_EQ(compareImages(a, b).within, 0.5) << channel;
    b.at(0, 0)[channel] = 0.0078f;
    EXPECT_EQ(compareImages(a, b).within, 1) << channel;
  }
}

TEST(Compare, NotFinitePixelsAreCountedAndLeftOut) {
  Image a(4, 1), b(4, 1);
  a.at(0, 0).x = kNan;
  a.at(1, 0).y = kInfinity, b.at(1, 0).y = kInfinity;
  b.at(1, 0).w = kNan;
  b.at(2, 0).x = 0.5f;
  const ImageDifference d = compareImages(a, b);
  EXPECT_EQ(d.channel[0].notFinite, 1u);
  EXPECT_EQ(d.channel[1].notFinite, 1u);
  EXPECT_EQ(d.channel[3].notFinite, 1u);
  EXPECT_EQ(d.overall.notFinite, 2u);
  EXPECT_DOUBLE_EQ(d.channel[0].rmse, std::sqrt(0.25 / 2));  // the two finite pixels
  EXPECT_DOUBLE_EQ(d.overall.rmse, std::sqrt(0.25 / 8));
  EXPECT_DOUBLE_EQ(d.within, 0.25);
}

TEST(Compare, LayersAreHeldAgainstEachOtherByName) {
  Image a = layered(4, 1), b = layered(4, 1);
  EXPECT_TRUE(failuresOf(compareImages(a, b)).empty());
  for (const LayerDifference& layer : compareImages(a, b).layers) {
    EXPECT_EQ(layer.channel.max, 0) << layer.name;
    EXPECT_EQ(layer.within, 1) << layer.name;
  }
  a.depth = {kNoDepth, kNoDepth, 3, 4};
  b.depth = {kNoDepth, 2, 3, 4.5f};
  b.layers[1].name = "shadow.rim";
  b.opticalDepth[2] += 0.25f;
  const ImageDifference d = compareImages(a, b);
  EXPECT_EQ(d.onlyInFirst, std::vector<std::string>{"shadow.key"});
  EXPECT_EQ(d.onlyInSecond, std::vector<std::string>{"shadow.rim"});
  const auto layer = [&](const std::string& name) {
    for (const LayerDifference& l : d.layers)
      if (l.name == name) return l;
    return LayerDifference{};
  };
  EXPECT_EQ(layer("Z").unmatched, 1u);
  EXPECT_EQ(layer("Z").within, 0.5);
  EXPECT_EQ(layer("Z").channel.max, 0.5);
  EXPECT_EQ(layer("optical_depth").within, 0.75);
  EXPECT_NEAR(layer("optical_depth").channel.max, 0.25, 1e-6);
  EXPECT_EQ(layer("optical_depth").channel.maxX, 2);
  EXPECT_SAYS(differenceJson(d), "\"optical_depth\"");
}

TEST(Compare, SmallNumbersOfALayerAreHeldToItsOwnScale) {
  Image a = layered(4, 1), b = layered(4, 1);
  for (Image* image : {&a, &b}) image->opticalDepth = {0, 0.02f, 0.05f, 0.01f};
  const auto opticalDepth = [&] {
    for (const LayerDifference& l : compareImages(a, b).layers)
      if (l.name == "optical_depth") return l;
    return LayerDifference{};
  };
  EXPECT_NEAR(opticalDepth().scale, 0.05, 1e-8);
  EXPECT_NEAR(opticalDepth().level, 0.02, 1e-8);
  b.opticalDepth[3] += 0.0003f;  // 2/255 of 0.05 is 0.00039
  EXPECT_EQ(opticalDepth().within, 1);
  b.opticalDepth[3] += 0.0002f;
  EXPECT_EQ(opticalDepth().within, 0.75);
  a.opticalDepth = {0, 0, 0, 0}, b.opticalDepth = {0, 0, 0, 7e-5f};  // 2/255 of the least scale, 0.01, is 7.8e-5
  EXPECT_EQ(opticalDepth().within, 1);
}

TEST(Compare, FailuresNameTheLayerAndWhatIsWrongWithIt) {
  const Image a = layered(4, 1);
  const auto failures = [&](const Image& b) { return failuresOf(compareImages(a, b)); };
  EXPECT_TRUE(failures(a).empty());
  Image far = a, endless = a, less = a;
  far.opticalDepth[0] += 1;
  endless.opticalDepth[1] = kNan;
  less.opticalDepth.clear();
  ASSERT_EQ(failures(far).size(), 1u);
  EXPECT_SAYS(failures(far)[0], "optical_depth: 75.0000 % of the pixels are within 2/255");
  ASSERT_EQ(failures(endless).size(), 2u);
  EXPECT_SAYS(failures(endless)[1], "optical_depth: 1 pixels are not finite");
  ASSERT_EQ(failures(less).size(), 1u);
  EXPECT_SAYS(failures(less)[0], "only the first picture has optical_depth");
  ASSERT_EQ(failuresOf(compareImages(less, a)).size(), 1u);
  EXPECT_SAYS(failuresOf(compareImages(less, a))[0], "only the second picture has optical_depth");
  // The same infinity in both is no agreement.
  Image infinite = a;
  infinite.opticalDepth[2] = kInfinity;
  EXPECT_EQ(failuresOf(compareImages(infinite, infinite)).size(), 2u);
}

TEST(Compare, DifferentSizesAreRefusedWithBoth) {
  const std::string message = messageOf<InputError>([] { compareImages(Image(4, 3), Image(3, 4)); });
  EXPECT_SAYS(message, "4 × 3");
  EXPECT_SAYS(message, "3 × 4");
  const TempFolder folder;
  EXPECT_THROW(writeDifferencePng(folder.file("d.png"), Image(4, 3), Image(3, 4)), InputError);
  EXPECT_TRUE(folder.entries().empty());
}

TEST(Compare, DifferencePictureShowsWhereAndHowMuch) {
  const TempFolder folder;
  Image a(4, 1), b(4, 1);
  b.at(1, 0) = vec4(0.1f, 0, 0, 0);
  b.at(2, 0) = vec4(0, 0, -9, 0.05f);
  b.at(3, 0).x = kNan;
  writeDifferencePng(folder.file("d.png"), a, b, 2);
  EXPECT_EQ(readPng(folder.file("d.png")).bytes,
            (std::vector<std::uint8_t>{0, 0, 0, 51, 0, 0, 26, 26, 255, 255, 0, 255}));  // 0.2·255, 0.1·255 = 25.5
}

}  // namespace
}  // namespace mote
