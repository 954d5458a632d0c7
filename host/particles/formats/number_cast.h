// Numbers of one type as numbers of another, with a count of what that changes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "host/particles/formats/number_type.h"

namespace mote {

/// Fills `to` with the numbers of `from`, neither of which need be aligned; returns how many are not the same number
/// afterwards (a NaN that stays one is the same). Floats are rounded to the nearest float, or to the nearest whole
/// number; what is beyond an integer type becomes its least or greatest, NaN becomes 0. In parallel.
std::uint64_t castNumbers(NumberType fromType, std::span<const std::byte> from, NumberType toType,
                          std::span<std::byte> to);

/// The smallest type that holds every number of both; of a 64-bit integer with a float or with one of the other sign
/// there is none: float64, which is exact up to 2^53.
NumberType commonType(NumberType a, NumberType b);

bool isFloat(NumberType type);
bool isSigned(NumberType type);

}  // namespace mote
