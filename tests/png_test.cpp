// PNG files as they land on disk, against hand-made pictures.
#include <gtest/gtest.h>
#include <png.h>

#include <cmath>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/image/png.h"
#include "tests/support/picture.h"
#include "tests/support/png_pixels.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

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

}  // namespace
}  // namespace mote
