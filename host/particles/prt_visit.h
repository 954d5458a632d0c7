// From a number type of the file to the C++ type that holds it. Brings Imath's half along: for .cpp files only.
#pragma once
#include <Imath/half.h>

#include <cstdint>

#include "host/particles/prt_format.h"

namespace mote {

/// Calls `body` with a zero of the C++ type that stands for `type`, and returns what it returns.
template <class Body>
auto withPrtType(PrtType type, const Body& body) {
  switch (type) {
    case PrtType::I16: return body(std::int16_t{});
    case PrtType::I32: return body(std::int32_t{});
    case PrtType::I64: return body(std::int64_t{});
    case PrtType::F16: return body(Imath::half{});
    case PrtType::F64: return body(double{});
    case PrtType::U16: return body(std::uint16_t{});
    case PrtType::U32: return body(std::uint32_t{});
    case PrtType::U64: return body(std::uint64_t{});
    case PrtType::I8: return body(std::int8_t{});
    case PrtType::U8: return body(std::uint8_t{});
    case PrtType::F32: break;  // below, so that the function ends with a value
  }
  return body(float{});
}

}  // namespace mote
