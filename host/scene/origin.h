// Scenes far from the origin: what their coordinates are measured from.
#pragma once
#include "host/scene/scene.h"

namespace mote {

/// Where a box of coordinates is best measured from so that float32 loses little: 0 on an axis where it lies within
/// eight of its half lengths (the longest axis') of 0, else its middle there, rounded to a power of two of about that
/// half length. What stands in float32 then stays exact when it is subtracted. `half` is at least `least`, > 0 where
/// the box is a single point.
dvec3 originOf(const dvec3& lo, const dvec3& hi, double least = 0);

/// Makes `origin` the point that places of the camera, of its keys and of lights are measured from; those of solids and
/// particles are when they are loaded. May be called again, with the same origin or another.
void moveOrigin(Scene& scene, const dvec3& origin);

}  // namespace mote
