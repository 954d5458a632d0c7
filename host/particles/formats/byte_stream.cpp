#include "host/particles/formats/byte_stream.h"

#include <algorithm>
#include <cstring>

namespace mote {
namespace {

constexpr std::size_t kBufferBytes = 1 << 19;

}  // namespace

ByteStream::ByteStream(const InputFile& file, std::uint64_t from) : file_(file), at_(from) { file.seek(from); }

void ByteStream::seek(std::uint64_t position) {
  const std::uint64_t begin = at_ - used_;
  if (position >= begin && position - begin <= buffer_.size()) {
    used_ = static_cast<std::size_t>(position - begin);
  } else {
    file_.seek(position);
    buffer_.clear(), used_ = 0;
  }
  at_ = position;
}

bool ByteStream::skipTo(char c) {
  while (used_ < buffer_.size() || refill()) {
    const std::byte* begin = buffer_.data() + used_;
    const void* found = std::memchr(begin, c, buffer_.size() - used_);
    const std::size_t step =
        found ? static_cast<std::size_t>(static_cast<const std::byte*>(found) - begin) : buffer_.size() - used_;
    used_ += step, at_ += step;
    if (found) return true;
  }
  return false;
}

std::string ByteStream::word(std::size_t most) {
  while (isSpace(peek())) next();
  std::string word;
  while (word.size() < most && peek() >= 0 && !isSpace(peek())) word += static_cast<char>(next());
  return word;
}

std::string ByteStream::line(std::size_t most) {
  std::string line;
  while (line.size() < most && peek() >= 0 && peek() != '\n') line += static_cast<char>(next());
  if (peek() == '\n') next();
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

bool ByteStream::refill() {
  // Not more than the file has: to clear the rest takes longer than to read a short one.
  buffer_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kBufferBytes, file_.bytes() + 1)));
  buffer_.resize(file_.read(buffer_.data(), buffer_.size()));
  used_ = 0;
  return !buffer_.empty();
}

}  // namespace mote
