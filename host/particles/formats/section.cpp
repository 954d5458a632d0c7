#include "host/particles/formats/section.h"

#include <fmt/format.h>

#include "host/core/error.h"

namespace mote {

std::string shown(std::string_view raw) {
  constexpr std::size_t kMost = 40;
  std::string text = "'";
  for (const char c : raw.substr(0, kMost))
    text += c >= 32 && c < 127 ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  return text + (raw.size() > kMost ? "…'" : "'");
}

std::string Section::bytes(std::uint64_t count, std::string_view what) {
  const auto fail = [&](std::uint64_t got) {
    throw InputError(file_.path(), what, fmt::format("{} bytes at byte {}", count, at_), fmt::format("only {}", got),
                     "the file is cut off or its header is damaged");
  };
  if (count > left()) fail(left());
  std::string data(count, '\0');
  if (const std::size_t got = file_.read(reinterpret_cast<std::byte*>(data.data()), count); got != count) fail(got);
  at_ += count;
  return data;
}

void Section::skip(std::uint64_t count) {
  at_ += count;
  file_.seek(at_);
}

}  // namespace mote
