#include "host/particles/formats/prt_metadata.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <string_view>

namespace mote {
namespace {

constexpr std::string_view kMeters = "LengthUnitInMeters", kMicrometers = "LengthUnitInMicrometers";
constexpr double kMicrometersInMeter = 1e6;
/// Numbered as PRT 1.x has them.
constexpr std::string_view kInterpretations[] = {"Unspecified", "Point",    "Vector", "Normal",
                                                 "Orientation", "Rotation", "Scalar"};

bool isOne(const Metadata& value, NumberType type) {
  return value.type == static_cast<std::int32_t>(type) && value.bytes.size() == numberSize(type);
}

double doubleOf(const Metadata& value) {
  double number;
  std::memcpy(&number, value.bytes.data(), sizeof number);
  return number;
}

}  // namespace

void toPrt1(Metadata& value) {
  if (value.channel.empty() && value.name == kMicrometers && isOne(value, NumberType::F64))
    value = Metadata::float64("", std::string(kMeters), doubleOf(value) / kMicrometersInMeter);
  if (value.name != "Interpretation" || value.type != kMetadataText) return;
  const auto found = std::find(std::begin(kInterpretations), std::end(kInterpretations), value.bytes);
  if (found != std::end(kInterpretations))
    value = Metadata::int32(value.channel, value.name, static_cast<std::int32_t>(found - std::begin(kInterpretations)));
}

void toPrt2(Metadata& value) {
  if (value.channel.empty() && value.name == kMeters && isOne(value, NumberType::F64))
    value = Metadata::float64("", std::string(kMicrometers), doubleOf(value) * kMicrometersInMeter);
  if (value.name != "Interpretation" || !isOne(value, NumberType::I32)) return;
  std::int32_t kind;
  std::memcpy(&kind, value.bytes.data(), sizeof kind);
  if (kind >= 0 && kind < static_cast<std::int32_t>(std::size(kInterpretations)))
    value = Metadata::text(value.channel, value.name, std::string(kInterpretations[kind]));
}

}  // namespace mote
