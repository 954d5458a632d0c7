#include "host/image/png.h"

#include <png.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <limits>

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
float decodeSrgb(float e) { return e <= 0.04045f ? e / 12.92f : std::pow((e + 0.055f) / 1.055f, 2.4f); }

/// A file that is being read. libpng's simplified interface would turn what it takes for linear (16 bits) or what a
/// gAMA chunk says into sRGB; this one leaves every number as it stands in the file.
class PngFile {
 public:
  explicit PngFile(const std::string& path) : stream_(std::fopen(path.c_str(), "rb")) {
    if (!stream_) throw InputError(path, "", "a PNG picture", std::strerror(errno));
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, onError, [](png_structp, png_const_charp) {});
    if (png_) info_ = png_create_info_struct(png_);
    MOTE_CHECK(info_ != nullptr, ==, true);
  }
  ~PngFile() {
    png_destroy_read_struct(&png_, &info_, nullptr);
    if (stream_) std::fclose(stream_);
  }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;

  /// False after an error, which message() tells. No object with a destructor may live in here: errors jump.
  bool readHeader() {
    if (setjmp(png_jmpbuf(png_))) return false;
    png_init_io(png_, stream_);
    png_read_info(png_, info_);
    return true;
  }
  /// RGBA of bits() a channel, as a machine has its numbers.
  bool readRows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_))) return false;
    png_set_expand(png_);  // palettes, fewer than 8 bits, transparent colours
    png_set_gray_to_rgb(png_);
    png_set_add_alpha(png_, 0xffff, PNG_FILLER_AFTER);
    if (std::endian::native == std::endian::little) png_set_swap(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  png_uint_32 width() const { return png_get_image_width(png_, info_); }
  png_uint_32 height() const { return png_get_image_height(png_, info_); }
  int bits() const { return png_get_bit_depth(png_, info_) == 16 ? 16 : 8; }
  const char* message() const { return message_; }

 private:
  static void onError(png_structp png, png_const_charp message) {
    auto* self = static_cast<PngFile*>(png_get_error_ptr(png));
    std::snprintf(self->message_, sizeof self->message_, "%s", message);
    png_longjmp(png, 1);
  }

  std::FILE* stream_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  char message_[128] = "";
};

template <class Number>
Image readImage(const std::string& path, PngFile& file, PngValues values) {
  const std::size_t width = file.width(), height = file.height();
  std::vector<Number> numbers(4 * width * height);
  std::vector<png_bytep> rows(height);
  for (std::size_t y = 0; y < height; ++y) rows[y] = reinterpret_cast<png_bytep>(&numbers[4 * width * y]);
  if (!file.readRows(rows.data())) throw InputError(path, "", "a whole PNG picture", file.message());
  Image image(static_cast<int>(width), static_cast<int>(height));
  constexpr float kGreatest = std::numeric_limits<Number>::max();
  parallelBlocks(image.pixels.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (int c = 0; c < 4; ++c) {
        const float value = static_cast<float>(numbers[4 * i + static_cast<std::size_t>(c)]) / kGreatest;
        image.pixels[i][c] = values == PngValues::Color && c < 3 ? decodeSrgb(value) : value;
      }
  });
  return image;
}

}  // namespace

Image readPng(const std::string& path, PngValues values) {
  constexpr png_uint_32 kMost = 16384;
  PngFile file(path);
  if (!file.readHeader()) throw InputError(path, "", "a PNG picture", file.message());
  if (file.width() > kMost || file.height() > kMost)
    throw InputError(path, "", fmt::format("at most {0} × {0} pixels", kMost),
                     fmt::format("{} × {}", file.width(), file.height()));
  return file.bits() == 16 ? readImage<std::uint16_t>(path, file, values) : readImage<std::uint8_t>(path, file, values);
}

}  // namespace mote
