// The types of numbers in files of particles.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace mote {

/// Numbered as PRT has them.
enum class NumberType : std::int32_t { I16, I32, I64, F16, F32, F64, U16, U32, U64, I8, U8 };
constexpr std::int32_t kNumberTypes = 11;

/// Bytes of one number: 1, 2, 4 or 8.
std::size_t numberSize(NumberType type);
/// "float32", "int8", …
std::string_view numberName(NumberType type);
/// The type of that name.
std::optional<NumberType> numberNamed(std::string_view name);

}  // namespace mote
