// What `mote convert` and `mote repair` say of a file that they wrote.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "host/particles/conversion.h"

namespace mote {

nlohmann::ordered_json conversionJson(const ConversionReport& report);
/// For people, to stdout.
void printConversion(const ConversionReport& report);

}  // namespace mote
