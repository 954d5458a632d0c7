#include "host/particles/formats/text_number.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

#include "host/particles/formats/number_visit.h"

namespace mote {

std::optional<double> numberIn(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::strtod(std::string(word).c_str(), nullptr);
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

bool storeNumberIn(std::string_view word, NumberType type, std::byte* to) {
  if (word.starts_with('+')) word.remove_prefix(1);
  // Straight into the type, so that nothing is rounded twice; what is written otherwise (1e3 for an integer, a float
  // beyond its range) goes by way of double.
  const bool stored = withNumberType(type, [&]<class T>(T) {
    if constexpr (std::is_same_v<T, Imath::half>) {
      return false;
    } else {
      T number{};
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      if (error != std::errc() || end != word.data() + word.size()) return false;
      std::memcpy(to, &number, sizeof number);
      return true;
    }
  });
  if (stored) return true;
  const std::optional<double> value = numberIn(word);
  if (value) storeNumber(*value, type, to);
  return value.has_value();
}

void storeNumber(double value, NumberType type, std::byte* to) {
  withNumberType(type, [&]<class T>(T number) {
    if constexpr (std::is_integral_v<T>) {  // 2^63 and 2^64 are the least that do not fit
      if (value >= static_cast<double>(std::numeric_limits<T>::min()) &&
          value < std::ldexp(1.0, std::numeric_limits<T>::digits))
        number = static_cast<T>(value);
    } else {
      number = static_cast<T>(value);
    }
    std::memcpy(to, &number, sizeof number);
  });
}

}  // namespace mote
