// From a file's own coordinates and sizes to the scene's.
#pragma once
#include "host/particles/loaded_source.h"

namespace mote {

/// Gives every particle a radius by the source's rule, in the file's own units: a number, a channel times a factor, or
/// for Auto the channel where there is one, else 1.5 × meanNeighbourDistance for all of the source. Throws InputError
/// where there is no spacing to take a radius from.
void applyRadiusRule(const ParticleSource& source, LoadedSource& loaded);

/// The file's axes and unit, then the source's scale, rotate about x, y, z and translate, in double; radii, whatever
/// their rule, and velocities scale along, and cross-sections with the square (in mode Peak: densities stay); colour,
/// absorption and emission stay.
void moveIntoScene(const ParticleSource& source, DensityMode mode, LoadedSource& loaded);

}  // namespace mote
