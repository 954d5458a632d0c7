// A file that is read, for readers of particles.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace mote {

/// Bytes of which deflate, zlib and gzip make one at most: 258 of two bits, less the heads of their blocks (zlib.net,
/// "Maximum Compression Factor"). LZ4 makes one of 255.
constexpr std::uint64_t kDeflateExpansion = 1032;

class InputFile {
 public:
  /// Throws InputError where there is none, or where it is no regular file that may be read.
  explicit InputFile(std::string path);

  const std::string& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }
  std::FILE* handle() const { return file_.get(); }

  /// Throws MachineError where the machine refuses.
  void seek(std::uint64_t position) const;
  /// As many as there are, from where the file is: fewer than `wanted` only at its end.
  std::size_t read(std::byte* to, std::size_t wanted) const;
  /// The file's first bytes, at most so many; the position is the beginning again.
  std::vector<std::byte> start(std::size_t most) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t bytes_ = 0;
};

/// A file that may be packed with gzip, read as what was packed.
class GzipFile {
 public:
  /// As InputFile's.
  explicit GzipFile(std::string path);

  const std::string& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }  ///< of the file as it is
  bool packed() const { return packed_; }
  /// What it can hold at most: its bytes, or what they could be unpacked to.
  std::uint64_t mostBytes() const { return packed_ ? bytes_ * kDeflateExpansion : bytes_; }

  /// Back to a place of what was packed: all before it is unpacked again.
  void seek(std::uint64_t position) const;
  /// As many as there are: fewer than `wanted` only at the end. Throws InputError where the packed data are damaged.
  std::size_t read(std::byte* to, std::size_t wanted) const;

 private:
  struct Close {
    void operator()(void* file) const;
  };
  std::string path_;
  std::unique_ptr<void, Close> file_;  // zlib's
  std::uint64_t bytes_ = 0;
  bool packed_ = false;
};

/// Whether a file that begins so is packed with gzip, and the beginning of what was packed, at most `most` bytes.
bool beginsAsGzip(std::span<const std::byte> start);
std::vector<std::byte> unpackedStart(std::span<const std::byte> start, std::size_t most);

}  // namespace mote
