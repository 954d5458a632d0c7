#include "host/core/error.h"

#include <csignal>
#include <cstdlib>

#include "host/core/log.h"

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
  constexpr int kAborted = 128 + SIGABRT;  // what shells make of it
  logError(fmt::format("internal error at {}:{}: {} fails: {} against {}", file, line, expression, left, right),
           kAborted);
  std::abort();
}

}  // namespace mote
