// What PRT 1.x and PRT 2 call the same values (their makers' prt_metadata.hpp), for writers.
#pragma once
#include "host/particles/formats/channel.h"

namespace mote {

/// In place; what has the same name in both stays.
///   PRT 1.x                        PRT 2
///   LengthUnitInMeters (float64)   LengthUnitInMicrometers (float64)
///   Interpretation (int32)         Interpretation (text: Point, Vector …)
void toPrt1(Metadata& value);
void toPrt2(Metadata& value);

}  // namespace mote
