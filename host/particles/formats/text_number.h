// Numbers in text, for readers of tables.
#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include "host/particles/formats/number_type.h"

namespace mote {

/// The number that a whole word is; what is beyond a double's range as strtod has it. None: it is no number.
std::optional<double> numberIn(std::string_view word);

/// Stores the number that a whole word is, which need not be aligned: the nearest of `type`, whole numbers of 64 bits
/// to the last digit; 0 where an integer type cannot hold it. False: it is no number.
bool storeNumberIn(std::string_view word, NumberType type, std::byte* to);

/// Stores a number as one of `type`, which need not be aligned; 0 where an integer type cannot hold it.
void storeNumber(double value, NumberType type, std::byte* to);

}  // namespace mote
