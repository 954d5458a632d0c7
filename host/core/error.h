// The three ways Mote fails, and what each owes the reader.
//
//   InputError    a file, a scene value or a flag is wrong          exit 2
//   MachineError  the device, memory or disk refused                exit 3
//   MOTE_CHECK    a bug in Mote: prints both sides and aborts
//
// Library code throws; only `main` catches.
#pragma once
#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <string_view>

namespace mote {

/// Base of everything Mote throws; what() is one complete sentence for the user.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bad input: place (file or flag), field, what was expected, what was got, and a hint where one helps.
class InputError : public Error {
 public:
  using Error::Error;
  /// "place: field: expected E, got G (hint)"; an empty field or hint is left out.
  InputError(std::string_view place, std::string_view field, std::string_view expected, std::string_view got,
             std::string_view hint = {});
};

/// The machine refused: says the call and the numbers.
class MachineError : public Error {
 public:
  using Error::Error;
};

namespace detail {
[[noreturn]] void checkFailed(const char* expression, const std::string& left, const std::string& right,
                              const char* file, int line);
}

}  // namespace mote

/// A bug if it fails: MOTE_CHECK(a, ==, b) prints both values and aborts. On in release builds too.
#define MOTE_CHECK(left, op, right)                                                       \
  do {                                                                                    \
    const auto& moteLeft_ = (left);                                                       \
    const auto& moteRight_ = (right);                                                     \
    if (!(moteLeft_ op moteRight_))                                                       \
      ::mote::detail::checkFailed(#left " " #op " " #right, fmt::format("{}", moteLeft_), \
                                  fmt::format("{}", moteRight_), __FILE__, __LINE__);     \
  } while (false)
