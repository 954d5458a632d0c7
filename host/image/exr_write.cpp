#include <ImathBox.h>
#include <ImathMatrix.h>
#include <OpenEXR/Iex.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfFramesPerSecond.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <half.h>

#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/image/exr.h"

namespace mote {
namespace {

constexpr float kHalfMax = 65504.0f;  // the largest finite half

/// OpenEXR's own stream loses what fails after its last check: it writes the line table in a destructor, and the last
/// buffer when the file closes. This one remembers the first failure.
class CheckedStream : public Imf::OStream {
 public:
  explicit CheckedStream(const OutputFile& file)
      : OStream(file.path().c_str()), file_(std::fopen(file.temporaryPath().c_str(), "wb")) {
    if (!file_) error_ = errno;
  }
  ~CheckedStream() override {
    if (file_) std::fclose(file_);
  }
  void write(const char bytes[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (error_ == 0 && std::fwrite(bytes, 1, size, file_) != size) error_ = errno;
    if (error_ != 0) throw Iex::IoExc(std::strerror(error_));
    position_ += size;
    if (position_ > size_) size_ = position_;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override {
    if (error_ == 0 && ::fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0) error_ = errno;
    if (error_ != 0) throw Iex::IoExc(std::strerror(error_));
    position_ = position;
  }
  /// Closes; errno of the first failure, 0 for none.
  int close() {
    if (file_ && std::fclose(file_) != 0 && error_ == 0) error_ = errno;
    file_ = nullptr;
    return error_;
  }
  std::uint64_t size() const { return size_; }

 private:
  std::FILE* file_;
  std::uint64_t position_ = 0, size_ = 0;
  int error_ = 0;
};

Imf::Compression compressionOf(ExrCompression compression) {
  switch (compression) {
    case ExrCompression::None: return Imf::NO_COMPRESSION;
    case ExrCompression::Rle: return Imf::RLE_COMPRESSION;
    case ExrCompression::Zips: return Imf::ZIPS_COMPRESSION;
    case ExrCompression::Zip: return Imf::ZIP_COMPRESSION;
    case ExrCompression::Piz: return Imf::PIZ_COMPRESSION;
  }
  return Imf::ZIP_COMPRESSION;
}

Imath::M44f matrixOf(const mat4& m) {  // glm's columns are OpenEXR's rows, see ExrOptions
  Imath::M44f out;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) out[i][j] = m[i][j];
  return out;
}

Imf::Header headerOf(const Image& image, const ExrOptions& options) {
  Imf::Header header(image.width, image.height, options.pixelAspectRatio);
  header.compression() = compressionOf(options.compression);
  const Imf::PixelType colour = options.precision == ExrPrecision::Half ? Imf::HALF : Imf::FLOAT;
  for (const char* name : {"R", "G", "B", "A"}) header.channels().insert(name, Imf::Channel(colour));
  if (!image.depth.empty()) header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  if (options.worldToCamera) Imf::addWorldToCamera(header, matrixOf(*options.worldToCamera));
  if (options.worldToNDC) Imf::addWorldToNDC(header, matrixOf(*options.worldToNDC));
  if (options.framesPerSecond) Imf::addFramesPerSecond(header, Imf::guessExactFps(*options.framesPerSecond));
  if (options.frame) header.insert("frame", Imf::IntAttribute(*options.frame));
  for (const auto& [name, value] : options.strings) header.insert(name, Imf::StringAttribute(value));
  return header;
}

struct HalfPixel {
  Imath::half channel[4];
};

/// Also counts the values that half cannot hold.
std::vector<HalfPixel> toHalf(const std::vector<vec4>& pixels, std::size_t& clamped) {
  std::vector<HalfPixel> out(pixels.size());
  std::atomic<std::size_t> count{0};
  parallelBlocks(pixels.size(), 65536, [&](std::size_t begin, std::size_t end) {
    std::size_t mine = 0;
    for (std::size_t i = begin; i < end; ++i)
      for (int c = 0; c < 4; ++c) {
        float value = pixels[i][c];
        if (std::fabs(value) > kHalfMax) value = std::copysign(kHalfMax, value), ++mine;
        out[i].channel[c] = Imath::half(value);
      }
    count += mine;
  });
  clamped = count;
  return out;
}

/// Slices over interleaved RGBA; OpenEXR only reads through them, whatever its type says.
template <class Channel>
Imf::FrameBuffer colourSlices(const Channel* first, Imf::PixelType type, int width) {
  Imf::FrameBuffer buffer;
  constexpr std::size_t kPixel = 4 * sizeof(Channel);
  const char* const names[] = {"R", "G", "B", "A"};
  for (std::size_t c = 0; c < 4; ++c)
    buffer.insert(names[c], Imf::Slice(type, reinterpret_cast<char*>(const_cast<Channel*>(first + c)), kPixel,
                                       kPixel * static_cast<std::size_t>(width)));
  return buffer;
}

}  // namespace

void writeExr(const std::string& path, const Image& image, const ExrOptions& options) {
  MOTE_CHECK(image.width, >, 0);
  MOTE_CHECK(image.height, >, 0);
  MOTE_CHECK(image.pixels.size(), ==, std::size_t(image.width) * image.height);
  OutputFile file(path);  // first: a wrong path is reported before any work

  std::size_t clamped = 0;
  std::vector<HalfPixel> halves;
  Imf::FrameBuffer buffer;
  if (options.precision == ExrPrecision::Half) {
    halves = toHalf(image.pixels, clamped);
    buffer = colourSlices(halves[0].channel, Imf::HALF, image.width);
  } else {
    buffer = colourSlices(&image.pixels[0].x, Imf::FLOAT, image.width);
  }
  if (!image.depth.empty()) {
    MOTE_CHECK(image.depth.size(), ==, image.pixels.size());
    buffer.insert("Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(const_cast<float*>(image.depth.data())),
                                  sizeof(float), sizeof(float) * static_cast<std::size_t>(image.width)));
  }
  if (clamped > 0)
    logWarning(fmt::format("{}: {} values beyond half's range were clamped to {}; \"precision\": \"float\" keeps them",
                           path, clamped, kHalfMax));

  CheckedStream stream(file);
  std::string reason;
  try {
    // Blocks are compressed on `threads` threads and written in order by this one.
    const int threads = static_cast<int>(threadCount());
    if (threads > 1 && Imf::globalThreadCount() == 0) Imf::setGlobalThreadCount(threads);
    Imf::OutputFile exr(stream, headerOf(image, options), threads > 1 ? threads : 0);
    exr.setFrameBuffer(buffer);
    exr.writePixels(image.height);
  } catch (const std::exception& e) {
    reason = e.what();
  }
  if (const int error = stream.close(); error != 0)
    throw MachineError(
        fmt::format("{}: writing the picture failed after {} bytes: {}", path, stream.size(), std::strerror(error)));
  if (!reason.empty()) throw MachineError(fmt::format("{}: OpenEXR cannot write the picture: {}", path, reason));
  file.commit();
}

}  // namespace mote
