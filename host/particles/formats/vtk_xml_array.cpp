#include "host/particles/formats/vtk_xml_array.h"

#include <fmt/format.h>
#include <lz4.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "host/core/error.h"
#include "host/particles/formats/base64_bytes.h"
#include "host/particles/formats/byte_stream.h"
#include "host/particles/formats/section.h"
#include "host/particles/formats/text_number.h"

namespace mote {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;
constexpr std::size_t kMostWord = 256;
/// VTK's own are 32 KiB unless somebody asks for others. Only LZ4 needs a whole block in memory.
constexpr std::uint64_t kMostLz4Block = std::uint64_t{1} << 28;

/// What all forms of an array need for their messages.
struct Array {
  const InputFile& file;
  VtkXmlCoding coding;
  VtkXmlPlace place;
  NumberType type;
  std::uint64_t count;
  std::string what;

  std::uint64_t bytes() const { return count * numberSize(type); }  // openVtkXmlNumbers sees to its range
  [[noreturn]] void fail(const std::string& expected, const std::string& got, const char* hint) const {
    throw InputError(file.path(), what, expected, got, hint);
  }
  [[noreturn]] void cutOff() const {
    fail(fmt::format("{} numbers of {} at byte {}", count, numberName(type), place.begin), "fewer",
         "the file is cut off or damaged");
  }
};

// ---- text ----

class TextNumbers : public VtkXmlNumbers {
 public:
  explicit TextNumbers(Array array) : array_(std::move(array)), at_(array_.place.begin) {
    const std::uint64_t characters = array_.place.end - array_.place.begin;
    if (array_.count > (characters + 1) / 2) array_.cutOff();  // a digit each, and what parts them
    array_.file.seek(at_);
  }

  void read(std::byte* to, std::size_t count) override {
    const std::size_t size = numberSize(array_.type);
    for (std::size_t k = 0; k < count; ++k, ++done_) store(word(), to + k * size);
  }
  bool bigEndian() const override { return false; }
  std::uint64_t bytesInFile() const override { return array_.place.end - array_.place.begin; }

 private:
  /// The next one; empty at the end.
  std::string_view word() {
    const auto blank = [&](std::size_t k) { return ByteStream::isSpace(text_[k]); };
    for (;;) {
      while (used_ < text_.size() && blank(used_)) ++used_;
      std::size_t end = used_;
      while (end < text_.size() && end - used_ < kMostWord && !blank(end)) ++end;
      // A word that ends with what has been read may go on behind it.
      if (end == text_.size() && at_ < array_.place.end) {
        refill();
        continue;
      }
      const std::string_view found(text_.data() + used_, end - used_);
      used_ = end;
      return found;
    }
  }

  void refill() {
    text_.erase(0, used_), used_ = 0;
    const std::size_t old = text_.size();
    text_.resize(old + static_cast<std::size_t>(std::min<std::uint64_t>(kBufferBytes, array_.place.end - at_)));
    const std::size_t got = array_.file.read(reinterpret_cast<std::byte*>(text_.data() + old), text_.size() - old);
    text_.resize(old + got), at_ += got;
    if (got == 0) array_.cutOff();
  }

  void store(std::string_view word, std::byte* to) const {
    if (array_.type == NumberType::I64 || array_.type == NumberType::U64) {  // a double has not all of their digits
      if (storeWhole<std::int64_t>(word, to) || storeWhole<std::uint64_t>(word, to)) return;
    }
    const std::optional<double> value = numberIn(word);
    if (!value)
      array_.fail(fmt::format("{} numbers", array_.count),
                  word.empty() ? fmt::format("{}", done_) : fmt::format("{} as number {}", shown(word), done_),
                  word.empty() ? "the file is cut off or damaged" : "");
    storeNumber(*value, array_.type, to);
  }
  template <class T>
  static bool storeWhole(std::string_view word, std::byte* to) {
    T value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || error != std::errc() || end != word.data() + word.size()) return false;
    std::memcpy(to, &value, sizeof value);
    return true;
  }

  Array array_;
  std::uint64_t at_, done_ = 0;
  std::string text_;
  std::size_t used_ = 0;
};

// ---- binary ----

/// The file's bytes and the sizes in front of them.
class BinaryNumbers : public VtkXmlNumbers {
 public:
  explicit BinaryNumbers(Array array)
      : array_(std::move(array)),
        bytes_(array_.file, array_.place.begin, array_.place.end, array_.place.form == VtkXmlPlace::Form::Base64) {}
  bool bigEndian() const override { return array_.coding.bigEndian; }

 protected:
  void exactly(std::byte* to, std::size_t count) {
    if (bytes_.read(to, count) != count) array_.cutOff();
  }
  std::uint64_t size() {
    std::byte raw[8];
    const std::size_t width = array_.coding.headBytes;
    exactly(raw, width);
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < width; ++k)
      value |= std::to_integer<std::uint64_t>(raw[array_.coding.bigEndian ? width - 1 - k : k]) << (8 * k);
    return value;
  }
  void requireSize(std::uint64_t got) const {
    if (got != array_.bytes())
      array_.fail(fmt::format("{} bytes, {} numbers of {}", array_.bytes(), array_.count, numberName(array_.type)),
                  fmt::format("{} at byte {}", got, array_.place.begin),
                  "the file is damaged, or its header_type is not what its data have");
  }

  Array array_;
  Base64Bytes bytes_;
};

class PlainNumbers : public BinaryNumbers {
 public:
  explicit PlainNumbers(Array array) : BinaryNumbers(std::move(array)) {
    requireSize(size());
    if (array_.bytes() > bytes_.mostLeft()) array_.cutOff();
  }
  void read(std::byte* to, std::size_t count) override { exactly(to, count * numberSize(array_.type)); }
  std::uint64_t bytesInFile() const override { return array_.coding.headBytes + array_.bytes(); }
};

/// Blocks that are packed each for itself.
class PackedNumbers : public BinaryNumbers {
 public:
  explicit PackedNumbers(Array array) : BinaryNumbers(std::move(array)) {
    const std::uint64_t blocks = size();
    blockBytes_ = size(), lastBytes_ = size();
    if (lastBytes_ == 0) lastBytes_ = blockBytes_;  // it is full
    if (blocks > bytes_.mostLeft() / array_.coding.headBytes)
      array_.fail("sizes of blocks that are in the file", fmt::format("{} blocks", blocks),
                  "the file is cut off or damaged");
    constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
    if (blocks > 1 && blockBytes_ > (kMost - lastBytes_) / (blocks - 1))
      array_.fail("fewer bytes", fmt::format("{} blocks of {}", blocks, blockBytes_), "the file is damaged");
    requireSize(blocks == 0 ? 0 : (blocks - 1) * blockBytes_ + lastBytes_);
    for (std::uint64_t k = 0; k < blocks; ++k) {
      packed_.push_back(size());
      if (packed_[k] > bytes_.mostLeft() - std::min(bytes_.mostLeft(), inFile_)) array_.cutOff();
      inFile_ += packed_[k];
    }
    // Zero numbers may be packed in whatever their writer likes.
    const std::uint64_t most = array_.coding.packing == VtkXmlCoding::Packing::Zlib ? kDeflateExpansion : 255;
    if (array_.bytes() / most > inFile_)
      array_.fail(fmt::format("at most {} times the {} bytes that they are packed in", most, inFile_),
                  fmt::format("{} bytes", array_.bytes()), "the file is damaged");
  }

  void read(std::byte* to, std::size_t count) override {
    for (std::size_t wanted = count * numberSize(array_.type); wanted > 0;) {
      if (left_ == 0) {
        if (next_ == packed_.size()) array_.cutOff();
        packedLeft_ = packed_[next_++];
        left_ = next_ == packed_.size() ? lastBytes_ : blockBytes_;
        begin();
        continue;
      }
      const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(wanted, left_));
      unpack(to, here);
      to += here, wanted -= here, left_ -= here;
      if (left_ == 0) end();
    }
  }
  std::uint64_t bytesInFile() const override { return array_.coding.headBytes * (3 + packed_.size()) + inFile_; }

 protected:
  virtual void begin() = 0;
  virtual void unpack(std::byte* to, std::size_t count) = 0;
  virtual void end() = 0;
  [[noreturn]] void damaged(const char* how) const {
    array_.fail(fmt::format("valid data in block {} of {}", next_ - 1, packed_.size()), how, "the file is damaged");
  }
  /// The next bytes of the block as they are in the file, at most so many.
  std::span<const std::byte> raw(std::size_t most) {
    buffer_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(most, packedLeft_)));
    exactly(buffer_.data(), buffer_.size());
    packedLeft_ -= buffer_.size();
    return buffer_;
  }

  std::uint64_t left_ = 0;        ///< unpacked bytes of the block that are still to come
  std::uint64_t packedLeft_ = 0;  ///< bytes of it in the file that were not read yet

 private:
  std::vector<std::uint64_t> packed_;  ///< bytes of each block in the file
  std::uint64_t blockBytes_ = 0, lastBytes_ = 0, inFile_ = 0;
  std::size_t next_ = 0;
  std::vector<std::byte> buffer_;
};

/// In pieces: a block may be as large as it likes.
class ZlibNumbers : public PackedNumbers {
 public:
  explicit ZlibNumbers(Array array) : PackedNumbers(std::move(array)) {
    if (inflateInit(&stream_) != Z_OK) throw MachineError("zlib cannot start");
  }
  ~ZlibNumbers() override { inflateEnd(&stream_); }

 private:
  void begin() override {
    inflateReset(&stream_);
    stream_.avail_in = 0, ended_ = false;
  }
  void unpack(std::byte* to, std::size_t count) override {
    stream_.next_out = reinterpret_cast<Bytef*>(to);
    while (count > 0) {
      const auto here = static_cast<uInt>(std::min<std::size_t>(count, 1 << 30));  // zlib counts in 32 bits
      stream_.avail_out = here;
      inflateSome();
      if (ended_ && stream_.avail_out > 0) damaged("its end before all numbers");
      count -= here - stream_.avail_out;
    }
  }
  /// The checksum is behind the last number.
  void end() override {
    Bytef more = 0;
    stream_.next_out = &more, stream_.avail_out = 1;
    while (!ended_ && stream_.avail_out > 0) inflateSome();
    if (stream_.avail_out == 0) damaged("more than its size");
    while (packedLeft_ > 0) raw(kBufferBytes);
  }
  void inflateSome() {
    if (stream_.avail_in == 0) {
      const auto bytes = raw(kBufferBytes);
      if (bytes.empty()) damaged("its end");
      stream_.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data()));  // zlib does not write there
      stream_.avail_in = static_cast<uInt>(bytes.size());
    }
    const int status = inflate(&stream_, Z_NO_FLUSH);
    if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
      damaged(stream_.msg ? stream_.msg : "something else");
    ended_ = status == Z_STREAM_END;
  }

  z_stream stream_{};
  bool ended_ = false;
};

class Lz4Numbers : public PackedNumbers {
 public:
  explicit Lz4Numbers(Array array) : PackedNumbers(std::move(array)) {}

 private:
  void begin() override {
    if (left_ > kMostLz4Block || left_ / 255 > packedLeft_ || packedLeft_ > kMostLz4Block)
      damaged(fmt::format("{} bytes packed in {}", left_, packedLeft_).c_str());
    const auto packed = raw(static_cast<std::size_t>(packedLeft_));
    block_.resize(static_cast<std::size_t>(left_)), used_ = 0;
    if (LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(block_.data()),
                            static_cast<int>(packed.size()),
                            static_cast<int>(block_.size())) != static_cast<int>(block_.size()))
      damaged("something that LZ4 cannot unpack to its size");
  }
  void unpack(std::byte* to, std::size_t count) override {
    std::memcpy(to, block_.data() + used_, count);
    used_ += count;
  }
  void end() override {}

  std::vector<std::byte> block_;
  std::size_t used_ = 0;
};

}  // namespace

std::unique_ptr<VtkXmlNumbers> openVtkXmlNumbers(const InputFile& file, const VtkXmlCoding& coding,
                                                 const VtkXmlPlace& place, NumberType type, std::uint64_t count,
                                                 const std::string& what) {
  Array array{file, coding, place, type, count, what};
  // So that no sum of bytes overflows: a file cannot hold as many.
  if (count > std::numeric_limits<std::uint64_t>::max() / 4 / kDeflateExpansion || place.end < place.begin)
    array.cutOff();
  if (place.form == VtkXmlPlace::Form::Text) return std::make_unique<TextNumbers>(std::move(array));
  switch (coding.packing) {
    case VtkXmlCoding::Packing::Zlib: return std::make_unique<ZlibNumbers>(std::move(array));
    case VtkXmlCoding::Packing::Lz4: return std::make_unique<Lz4Numbers>(std::move(array));
    case VtkXmlCoding::Packing::None: break;
  }
  return std::make_unique<PlainNumbers>(std::move(array));
}

}  // namespace mote
