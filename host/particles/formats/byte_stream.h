// A file's bytes one after another, for readers that look for words between numbers.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/particles/formats/input_file.h"

namespace mote {

class ByteStream {
 public:
  /// `file` must outlive it.
  ByteStream(const InputFile& file, std::uint64_t from);

  std::uint64_t position() const { return at_; }
  /// −1 at the end.
  int next() {
    if (used_ == buffer_.size() && !refill()) return -1;
    ++at_;
    return static_cast<int>(buffer_[used_++]);
  }
  int peek() { return used_ == buffer_.size() && !refill() ? -1 : static_cast<int>(buffer_[used_]); }
  /// On to the next byte of that value; false: there is none, and this is the end.
  bool skipTo(char c);
  /// To a place in the file.
  void seek(std::uint64_t position);
  /// The next word, at most `most` characters of it; empty at the end.
  std::string word(std::size_t most);
  /// The rest of the line without its end, at most `most` characters; what is longer stays.
  std::string line(std::size_t most);

  static bool isSpace(int c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

 private:
  bool refill();

  const InputFile& file_;
  std::vector<std::byte> buffer_;
  std::size_t used_ = 0;
  std::uint64_t at_;
};

}  // namespace mote
