// A file that may be packed with gzip or as Houdini's .sc, read as what was packed, one byte after another or in runs.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/scf_file.h"

namespace mote {

class UnpackedFile {
 public:
  /// As InputFile's and ScfFile's.
  explicit UnpackedFile(std::string path);

  const std::string& path() const { return path_; }
  /// "", "gzip" or "Blosc".
  const char* packing() const { return scf_ ? "Blosc" : gzip_->packed() ? "gzip" : ""; }
  std::uint64_t bytes() const { return scf_ ? scf_->bytes() : gzip_->bytes(); }  ///< of the file as it is

  std::uint64_t position() const { return at_; }
  /// −1 at the end.
  int next() {
    if (used_ == buffer_.size() && !refill()) return -1;
    ++at_;
    return static_cast<int>(buffer_[used_++]);
  }
  int peek() { return used_ == buffer_.size() && !refill() ? -1 : static_cast<int>(buffer_[used_]); }
  /// As many as there are: fewer than `wanted` only at the end. Throws InputError where the packed data are damaged.
  std::size_t read(std::byte* to, std::size_t wanted);
  /// Steps over so many; false where there are fewer.
  bool skip(std::uint64_t count);
  /// To a place of what was packed: of gzip, all before it is unpacked.
  void seek(std::uint64_t position);

 private:
  bool refill();

  std::string path_;
  std::unique_ptr<GzipFile> gzip_;  ///< which reads what is not packed, too
  std::unique_ptr<ScfFile> scf_;
  std::size_t bufferBytes_ = 0;  ///< a small file's are few
  std::vector<std::byte> buffer_;
  std::size_t used_ = 0;
  std::uint64_t at_ = 0;
};

}  // namespace mote
