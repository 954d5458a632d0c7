// What particles must be: finite, and of a size.
#pragma once
#include "host/particles/loaded_source.h"

namespace mote {

/// Throws InputError for the first particle, array by array, whose position, radius, density, colour, absorption,
/// emission or velocity is not finite, whose radius is ≤ 0, or whose density, absorption or emission is < 0, with its
/// index and value. `when` follows what is wrong in the message: " in the scene".
void checkParticles(const LoadedSource& loaded, const char* when);

}  // namespace mote
