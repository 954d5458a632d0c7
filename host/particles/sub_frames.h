// Where particles are between frames: on the cubic curve through the files of a frame and of those beside it.
#pragma once
#include <string>
#include <vector>

#include "host/particles/loaded_source.h"
#include "host/particles/particle_loader.h"

namespace mote {

/// The cubic that is at x0 with the velocity v0 and `length` later at x1 with v1, `time` after x0 (Hermite). Off by
/// length⁴/384 · |x⁗| at most.
dvec3 hermiteAt(const dvec3& x0, const dvec3& v0, const dvec3& x1, const dvec3& v1, double length, double time);

/// Fills `shutterVelocity` and `shutterShift` of a source whose set is that of `frame`, placed and checked: where
/// particles are when the shutter of the rules opens and closes. Before the frame's time they are on the curve from the
/// frame before, after it on that to the frame after; beyond these, further along the velocity there. A particle goes
/// along its own velocity where no file is beside its own, or where its ID is not there (born: it comes along it; gone:
/// it goes on along it) or stands there or here more than once.
///
/// `openedFiles`, if given, gets the paths of the files beside. Throws InputError where the source has no frame number
/// in its name, or one of the files no Velocity or no ID. Cost: that of reading positions, velocities and IDs of two
/// files more, and of sorting the IDs.
void interpolateShutter(const ParticleSource& source, const LoadRules& rules, int frame, LoadedSource& loaded,
                        std::vector<std::string>* openedFiles);

}  // namespace mote
