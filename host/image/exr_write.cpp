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
#include "host/image/channels.h"
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

Imf::PixelType typeOf(const ChannelView& channel, const ExrOptions& options) {
  return channel.colour && options.precision == ExrPrecision::Half ? Imf::HALF : Imf::FLOAT;
}

Imf::Header headerOf(const Image& image, const std::vector<ChannelView>& channels, const ExrOptions& options) {
  Imf::Header header(image.width, image.height, options.pixelAspectRatio);
  header.compression() = compressionOf(options.compression);
  for (const ChannelView& channel : channels)
    header.channels().insert(channel.name, Imf::Channel(typeOf(channel, options)));
  if (options.worldToCamera) Imf::addWorldToCamera(header, matrixOf(*options.worldToCamera));
  if (options.worldToNDC) Imf::addWorldToNDC(header, matrixOf(*options.worldToNDC));
  if (options.framesPerSecond) Imf::addFramesPerSecond(header, Imf::guessExactFps(*options.framesPerSecond));
  if (options.frame) header.insert("frame", Imf::IntAttribute(*options.frame));
  for (const auto& [name, value] : options.strings) header.insert(name, Imf::StringAttribute(value));
  return header;
}

/// Also counts the values that half cannot hold.
std::vector<Imath::half> toHalf(const ChannelView& channel, std::size_t pixels, std::atomic<std::size_t>& clamped) {
  std::vector<Imath::half> out(pixels);
  parallelBlocks(pixels, 65536, [&](std::size_t begin, std::size_t end) {
    std::size_t mine = 0;
    for (std::size_t i = begin; i < end; ++i) {
      float value = channel.at(i);
      if (std::fabs(value) > kHalfMax) value = std::copysign(kHalfMax, value), ++mine;
      out[i] = Imath::half(value);
    }
    clamped += mine;
  });
  return out;
}

/// OpenEXR only reads through it, whatever its type says.
template <class Number>
Imf::Slice sliceOf(const Number* first, std::size_t stride, Imf::PixelType type, int width) {
  const std::size_t xStride = stride * sizeof(Number);
  return Imf::Slice(type, reinterpret_cast<char*>(const_cast<Number*>(first)), xStride,
                    xStride * static_cast<std::size_t>(width));
}

}  // namespace

void writeExr(const std::string& path, const Image& image, const ExrOptions& options) {
  MOTE_CHECK(image.width, >, 0);
  MOTE_CHECK(image.height, >, 0);
  MOTE_CHECK(image.pixels.size(), ==, std::size_t(image.width) * image.height);
  OutputFile file(path);  // first: a wrong path is reported before any work

  const std::vector<ChannelView> channels = channelsOf(image);
  std::atomic<std::size_t> clamped{0};
  std::vector<std::vector<Imath::half>> halves;  // one for each channel that is stored so
  Imf::FrameBuffer buffer;
  for (const ChannelView& channel : channels) {
    if (typeOf(channel, options) == Imf::HALF) {
      halves.push_back(toHalf(channel, image.pixels.size(), clamped));
      buffer.insert(channel.name, sliceOf(halves.back().data(), 1, Imf::HALF, image.width));
    } else {
      buffer.insert(channel.name, sliceOf(channel.first, channel.stride, Imf::FLOAT, image.width));
    }
  }
  if (clamped > 0)
    logWarning(fmt::format("{}: {} values beyond half's range were clamped to {}; \"precision\": \"float\" keeps them",
                           path, clamped.load(), kHalfMax));

  CheckedStream stream(file);
  std::string reason;
  try {
    // Blocks are compressed on `threads` threads and written in order by this one.
    const int threads = static_cast<int>(threadCount());
    if (threads > 1 && Imf::globalThreadCount() == 0) Imf::setGlobalThreadCount(threads);
    Imf::OutputFile exr(stream, headerOf(image, channels, options), threads > 1 ? threads : 0);
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
