#include "host/particles/formats/base64_bytes.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

namespace mote {
namespace {

constexpr std::size_t kTextBytes = 1 << 16;
constexpr std::uint8_t kNone = 255, kBlank = 254, kPadding = 253;  // all above the 64 values

constexpr std::array<std::uint8_t, 256> values() {
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<std::uint8_t, 256> table{};
  for (std::uint8_t& value : table) value = kNone;
  for (std::size_t k = 0; k < kAlphabet.size(); ++k)
    table[static_cast<unsigned char>(kAlphabet[k])] = static_cast<std::uint8_t>(k);
  for (const unsigned char c : {' ', '\t', '\n', '\r'}) table[c] = kBlank;
  table['='] = kPadding;
  return table;
}
constexpr std::array<std::uint8_t, 256> kValues = values();

}  // namespace

Base64Bytes::Base64Bytes(const InputFile& file, std::uint64_t begin, std::uint64_t end, bool base64)
    : file_(file), at_(std::min(begin, end)), end_(end), base64_(base64) {
  file.seek(at_);
}

std::size_t Base64Bytes::read(std::byte* to, std::size_t wanted) {
  if (!base64_) {
    const std::size_t got = file_.read(to, static_cast<std::size_t>(std::min<std::uint64_t>(wanted, end_ - at_)));
    at_ += got;
    return got;
  }
  std::size_t done = 0;
  while (done < wanted && (used_ < decoded_.size() || refill())) {
    const std::size_t here = std::min(wanted - done, decoded_.size() - used_);
    std::memcpy(to + done, decoded_.data() + used_, here);
    done += here, used_ += here;
  }
  return done;
}

bool Base64Bytes::refill() {
  decoded_.clear(), used_ = 0;
  unsigned char text[kTextBytes];
  while (decoded_.empty() && at_ < end_) {
    const std::size_t got = file_.read(reinterpret_cast<std::byte*>(text),
                                       static_cast<std::size_t>(std::min<std::uint64_t>(kTextBytes, end_ - at_)));
    if (got == 0) end_ = at_;
    at_ += got;
    decode(text, got);
  }
  return !decoded_.empty();
}

void Base64Bytes::decode(const unsigned char* text, std::size_t size) {
  decoded_.resize((size + 3) / 4 * 3 + 3);
  std::byte* to = decoded_.data();
  const auto put = [&](std::uint32_t bits, int shift) { *to++ = static_cast<std::byte>(bits >> shift & 0xff); };
  for (std::size_t k = 0; k < size; ++k) {
    if (characters_ == 0)
      for (; k + 4 <= size; k += 4) {  // whole groups, as nearly all are
        const std::uint32_t a = kValues[text[k]], b = kValues[text[k + 1]], c = kValues[text[k + 2]],
                            d = kValues[text[k + 3]];
        if ((a | b | c | d) > 63) break;
        const std::uint32_t bits = a << 18 | b << 12 | c << 6 | d;
        put(bits, 16), put(bits, 8), put(bits, 0);
      }
    if (k == size) break;
    const std::uint8_t value = kValues[text[k]];
    if (value == kBlank) continue;
    if (value == kNone) {
      at_ = end_;
      break;
    }
    if (value == kPadding) {  // one byte of two characters, two of three
      if (characters_ >= 2) put(group_ << (6 * (4 - characters_)), 16);
      if (characters_ == 3) put(group_ << 6, 8);
      characters_ = 0, group_ = 0;
      continue;
    }
    group_ = group_ << 6 | value;
    if (++characters_ < 4) continue;
    put(group_, 16), put(group_, 8), put(group_, 0);
    characters_ = 0, group_ = 0;
  }
  decoded_.resize(static_cast<std::size_t>(to - decoded_.data()));
}

}  // namespace mote
