// Numbers in text, for readers of tables.
#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include "host/particles/formats/number_type.h"

namespace mote {

/// The number that a whole word is; what is beyond a double's range as strtod has it. None: it is no number.
std::optional<double> numberIn(std::string_view word);

/// Stores a number as one of `type`, which need not be aligned; 0 where an integer type cannot hold it.
void storeNumber(double value, NumberType type, std::byte* to);

}  // namespace mote
