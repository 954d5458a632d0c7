#include "host/particles/formats/number_text.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <iterator>

#include "host/core/parallel.h"
#include "host/particles/formats/number_visit.h"

namespace mote {
namespace {

constexpr std::size_t kRowsAtOnce = 1 << 12;
/// The longest is a double's: -1.7976931348623157e+308.
constexpr std::size_t kMostDigits = 32;

template <class T>
char* digits(const std::byte* from, char* to) {
  T number;
  std::memcpy(&number, from, sizeof number);
  if constexpr (std::is_same_v<T, Imath::half>)  // what a half is has a float's shortest digits, too
    return std::to_chars(to, to + kMostDigits, static_cast<float>(number)).ptr;
  else
    return std::to_chars(to, to + kMostDigits, number).ptr;
}

void appendRows(std::span<const std::byte> rows, std::size_t rowBytes, std::span<const Channel> channels,
                char separator, std::string& out) {
  char buffer[kMostDigits + 1];
  for (std::size_t at = 0; at < rows.size(); at += rowBytes) {
    const std::byte* from = rows.data() + at;
    for (const Channel& channel : channels)
      withNumberType(channel.type, [&]<class T>(T) {
        for (std::uint32_t c = 0; c < channel.arity; ++c, from += sizeof(T)) {
          char* end = digits<T>(from, buffer);
          *end++ = separator;
          out.append(buffer, end);
        }
      });
    out.back() = '\n';
  }
}

}  // namespace

std::vector<std::string> rowsAsText(std::span<const std::byte> rows, std::size_t rowBytes,
                                    std::span<const Channel> channels, char separator) {
  const std::size_t count = rows.size() / rowBytes;
  std::vector<std::string> texts((count + kRowsAtOnce - 1) / kRowsAtOnce);
  parallelBlocks(count, kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
    appendRows(rows.subspan(begin * rowBytes, (end - begin) * rowBytes), rowBytes, channels, separator,
               texts[begin / kRowsAtOnce]);
  });
  return texts;
}

}  // namespace mote
