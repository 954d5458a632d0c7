// What a scene leaves open, chosen from where its particles are: the camera and one key light.
#pragma once
#include "host/core/vec.h"
#include "host/scene/scene.h"

namespace mote {

/// Fills in what `scene` marks as fitted and takes the marks away: calls after the first change nothing, so one Scene
/// kept over a sequence keeps the camera of its first frame. `supportBounds`: of the particles' supports, finite, not
/// empty (MOTE_CHECK).
///  * camera.fitted: position and target from slightly above so that the whole box is in the picture, with a margin of
///    5 % at each side, at the scene's up, output size and pixel aspect. Perspective: the distance by the camera's fov.
///    Orthographic: the distance is 3 radii of the box, and fittedHeight sets the height; a height that was given
///    stays, whatever of the box it shows. fittedDepths: near and far around the box.
///  * defaultLights: a point light "key" behind the box, to the upper left as the camera sees it. Its intensity makes a
///    white, isotropic, unshadowed scatterer at the box's centre have radiance 1: I = 4π d².
///
/// Keys: a camera is fitted only where no key has a position or target either. It is then placed by the camera's own
/// up, fov and height; keys may zoom or roll it there, and are not looked at. The light is placed as the camera stands
/// at its first key. Throws InputError where keys leave the fitted camera without a view there (cameraAt).
void fitDefaults(Scene& scene, const Bounds& supportBounds);

}  // namespace mote
