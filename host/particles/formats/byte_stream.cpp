#include "host/particles/formats/byte_stream.h"

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
  buffer_.resize(kBufferBytes);
  buffer_.resize(file_.read(buffer_.data(), kBufferBytes));
  used_ = 0;
  return !buffer_.empty();
}

}  // namespace mote
