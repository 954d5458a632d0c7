#include "host/particles/formats/number_type.h"

namespace mote {
namespace {

struct TypeFacts {
  std::string_view name;
  std::size_t size;
};
constexpr TypeFacts kTypes[kNumberTypes] = {{"int16", 2},   {"int32", 4},   {"int64", 8},  {"float16", 2},
                                            {"float32", 4}, {"float64", 8}, {"uint16", 2}, {"uint32", 4},
                                            {"uint64", 8},  {"int8", 1},    {"uint8", 1}};

}  // namespace

std::size_t numberSize(NumberType type) { return kTypes[static_cast<std::size_t>(type)].size; }
std::string_view numberName(NumberType type) { return kTypes[static_cast<std::size_t>(type)].name; }

std::optional<NumberType> numberNamed(std::string_view name) {
  for (std::int32_t k = 0; k < kNumberTypes; ++k)
    if (kTypes[k].name == name) return static_cast<NumberType>(k);
  return std::nullopt;
}

}  // namespace mote
