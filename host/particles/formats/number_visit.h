// From a number type of the file to the C++ type that holds it. Brings Imath's half along: for .cpp files only.
#pragma once
#include <Imath/half.h>

#include <cstdint>

#include "host/particles/formats/prt_format.h"

namespace mote {

/// Calls `body` with a zero of the C++ type that stands for `type`, and returns what it returns.
template <class Body>
auto withNumberType(NumberType type, const Body& body) {
  switch (type) {
    case NumberType::I16: return body(std::int16_t{});
    case NumberType::I32: return body(std::int32_t{});
    case NumberType::I64: return body(std::int64_t{});
    case NumberType::F16: return body(Imath::half{});
    case NumberType::F64: return body(double{});
    case NumberType::U16: return body(std::uint16_t{});
    case NumberType::U32: return body(std::uint32_t{});
    case NumberType::U64: return body(std::uint64_t{});
    case NumberType::I8: return body(std::int8_t{});
    case NumberType::U8: return body(std::uint8_t{});
    case NumberType::F32: break;  // below, so that the function ends with a value
  }
  return body(float{});
}

}  // namespace mote
