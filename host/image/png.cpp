#include "host/image/png.h"

#include <png.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "host/core/error.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"

namespace mote {

std::uint8_t encodeSrgb(float linear) {
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 255;
  const float encoded = linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(encoded * 255 + 0.5f);
}

void writePng(const std::string& path, const Image& image, float exposure) {
  const float gain = std::exp2(exposure);
  std::vector<std::uint8_t> rgb(image.pixels.size() * 3);
  parallelBlocks(image.pixels.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (int c = 0; c < 3; ++c) rgb[3 * i + c] = encodeSrgb(image.pixels[i][c] * gain);
  });
  writePngBytes(path, rgb, image.width, image.height);
}

void writePngBytes(const std::string& path, const std::vector<std::uint8_t>& rgb, int width, int height) {
  MOTE_CHECK(width, >, 0);
  MOTE_CHECK(rgb.size(), ==, 3 * std::size_t(width) * height);
  OutputFile file(path);
  std::FILE* stream = std::fopen(file.temporaryPath().c_str(), "wb");
  if (!stream) throw MachineError(fmt::format("{}: cannot open: {}", path, std::strerror(errno)));

  // libpng's simplified interface keeps its longjmp to itself and marks 8-bit RGB as sRGB.
  png_image picture{};
  picture.version = PNG_IMAGE_VERSION;
  picture.width = static_cast<png_uint_32>(width);
  picture.height = static_cast<png_uint_32>(height);
  picture.format = PNG_FORMAT_RGB;
  errno = 0;
  const bool written = png_image_write_to_stdio(&picture, stream, 0, rgb.data(), 3 * width, nullptr) != 0;
  int error = errno;
  const long bytes = std::ftell(stream);
  const bool closed = std::fclose(stream) == 0;
  if (!closed && error == 0) error = errno;
  if (!written || !closed)
    throw MachineError(fmt::format("{}: writing the picture failed after {} bytes: {}", path, bytes,
                                   error != 0 ? std::strerror(error) : picture.message));
  file.commit();
}

namespace {

/// Inverse of the sRGB encoding (IEC 61966-2-1).
float decodeSrgb(std::uint8_t encoded) {
  const float e = static_cast<float>(encoded) / 255;
  return e <= 0.04045f ? e / 12.92f : std::pow((e + 0.055f) / 1.055f, 2.4f);
}

}  // namespace

Image readPng(const std::string& path, PngValues values) {
  constexpr png_uint_32 kMost = 16384;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&png, path.c_str())) throw InputError(path, "", "a PNG picture", png.message);
  if (png.width > kMost || png.height > kMost) {
    png_image_free(&png);
    throw InputError(path, "", fmt::format("at most {0} × {0} pixels", kMost),
                     fmt::format("{} × {}", png.width, png.height));
  }
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(png));
  if (!png_image_finish_read(&png, nullptr, bytes.data(), 0, nullptr))
    throw InputError(path, "", "a whole PNG picture", png.message);
  float table[256];
  for (int i = 0; i < 256; ++i)
    table[i] = values == PngValues::Color ? decodeSrgb(static_cast<std::uint8_t>(i)) : static_cast<float>(i) / 255;
  Image image(static_cast<int>(png.width), static_cast<int>(png.height));
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = vec4(table[bytes[4 * i]], table[bytes[4 * i + 1]], table[bytes[4 * i + 2]],
                           static_cast<float>(bytes[4 * i + 3]) / 255);
  return image;
}

}  // namespace mote
