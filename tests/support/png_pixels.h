// A PNG file's pixels, by libpng itself.
#pragma once
#include <gtest/gtest.h>
#include <png.h>

#include <cstdint>
#include <string>
#include <vector>

namespace mote::test {

struct Png {
  int width = 0, height = 0, channels = 0, bits = 0, intent = -1;
  std::vector<std::uint8_t> bytes;
};

inline Png readPng(const std::string& path) {
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

}  // namespace mote::test
