// What particles must be: finite, and of a size.
#pragma once
#include "host/particles/loaded_source.h"

namespace mote {

/// Leaves out particles whose position, radius, density, colour, absorption, emission or velocity is not finite, whose
/// radius is ≤ 0, or whose density, absorption or emission is < 0, with one warning that counts them and names the
/// first of each kind. `loaded.index` then says which of the file's particles the others are.
///
/// `strict`: throws InputError for the first of them, array by array, with its index and value. So it does, strict or
/// not, where none is left. `when` follows what is wrong in the message: " in the scene".
void checkParticles(LoadedSource& loaded, bool strict, const char* when);

}  // namespace mote
