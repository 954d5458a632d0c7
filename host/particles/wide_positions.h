// Positions in double as the floats that keep most of them.
#pragma once
#include <span>
#include <vector>

#include "host/core/vec.h"
#include "host/particles/formats/number_type.h"

namespace mote {

/// Whether a number of this type may need more than float32 has.
bool isWide(NumberType type);

/// Fills `floats` with `wide` − c and returns c: what originOf finds for the box of those that are finite in float32, 0
/// where they lie near 0. What float32 holds is then kept to the last bit, near and far. The others come out as not
/// finite.
dvec3 toFloats(std::span<const dvec3> wide, std::vector<vec3>& floats);

}  // namespace mote
