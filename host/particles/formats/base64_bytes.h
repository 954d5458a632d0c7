// Bytes of a part of a file, which may be written as base64 (RFC 4648).
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/particles/formats/input_file.h"

namespace mote {

/// Goes through them once, in order. Several base64 texts one behind another, each with its own padding, are one run of
/// bytes; blanks between their characters are stepped over.
class Base64Bytes {
 public:
  /// `file` must outlive it, and nobody else may move it meanwhile.
  Base64Bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end, bool base64);

  /// As many as there are: fewer than `wanted` at the end, or before the first character that is none of base64.
  std::size_t read(std::byte* to, std::size_t wanted);
  /// What read() can give at most.
  std::uint64_t mostLeft() const { return base64_ ? decoded_.size() - used_ + (end_ - at_) / 4 * 3 + 3 : end_ - at_; }

 private:
  bool refill();
  void decode(const unsigned char* text, std::size_t size);

  const InputFile& file_;
  std::uint64_t at_, end_;
  bool base64_;
  std::vector<std::byte> decoded_;
  std::size_t used_ = 0;
  std::uint32_t group_ = 0;  ///< the bits of up to three characters
  int characters_ = 0;       ///< in group_
};

}  // namespace mote
