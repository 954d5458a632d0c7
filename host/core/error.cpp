#include "host/core/error.h"

#include <cstdio>
#include <cstdlib>

namespace mote {
namespace {

std::string sentence(std::string_view place, std::string_view field, std::string_view expected, std::string_view got,
                     std::string_view hint) {
  std::string text(place);
  if (!field.empty()) text += fmt::format(": {}", field);
  text += fmt::format(": expected {}, got {}", expected, got);
  if (!hint.empty()) text += fmt::format(" ({})", hint);
  return text;
}

}  // namespace

InputError::InputError(std::string_view place, std::string_view field, std::string_view expected, std::string_view got,
                       std::string_view hint)
    : Error(sentence(place, field, expected, got, hint)) {}

void detail::checkFailed(const char* expression, const std::string& left, const std::string& right, const char* file,
                         int line) {
  fmt::print(stderr, "mote: internal error at {}:{}: {} fails: {} against {}\n", file, line, expression, left, right);
  std::abort();
}

}  // namespace mote
