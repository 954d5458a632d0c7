// A part of a file that cannot be left, for readers of headers and chunks.
#pragma once
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "host/particles/formats/input_file.h"

namespace mote {

/// Bytes of a file in a message: what is not printed as its number, and not more than a line.
std::string shown(std::string_view raw);

/// Every read is checked against what the section has, before anything is allocated.
class Section {
 public:
  /// The file is read from `begin` on; nobody else may move it meanwhile.
  Section(const InputFile& file, std::uint64_t begin, std::uint64_t end) : file_(file), at_(begin), end_(end) {
    file.seek(begin);
  }

  std::uint64_t position() const { return at_; }
  std::uint64_t end() const { return end_; }
  std::uint64_t left() const { return end_ - at_; }

  /// Throws InputError, which says `what` was to be read, where fewer are left.
  std::string bytes(std::uint64_t count, std::string_view what);
  /// Little-endian.
  template <class T>
  T number(std::string_view what) {
    T value;
    std::memcpy(&value, bytes(sizeof(T), what).data(), sizeof value);
    return value;
  }
  /// `count` ≤ left(): callers check, who know the field's name.
  void skip(std::uint64_t count);

 private:
  const InputFile& file_;
  std::uint64_t at_, end_;
};

}  // namespace mote
