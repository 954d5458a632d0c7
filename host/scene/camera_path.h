// A camera that moves: what it is at a frame, by its keys.
#pragma once
#include <optional>
#include <string>

#include "host/scene/scene.h"

namespace mote {

/// The camera at a frame, which may be fractional: frame + t · fps is the camera t seconds after the frame's time.
///
/// Each property goes through the keys that name it; one that no key names stays the camera's own. Before the first
/// and after the last of its keys it has their values. Between, it is a cubic Hermite curve whose tangent at a key is
/// that of the parabola through the key and its two neighbours (Catmull and Rom's tangent where frames are evenly
/// spaced; at the end keys, the parabola of the nearest three). So it passes exactly through every key, its velocity
/// is continuous between the first key and the last, and what moves steadily from key to key moves steadily in
/// between. Like every such curve it swings past a key where the motion stops abruptly; a key more holds it.
///
/// Computed in double; what the camera has as floats is rounded. The result has no keys; `fitted` marks stay as they
/// are. Throws InputError where the view is undefined (viewFault), or fov, height or focus distance leave their range.
/// Cost: proportional to the number of keys, for moments of a frame and not for each particle.
Camera cameraAt(const Camera& camera, double frame);

/// The same without the check; for keys that are not in order, some finite camera or none.
Camera interpolatedCamera(const Camera& camera, double frame);

/// Depth that is sharp [scene units]: the camera's own, else the distance from its position to its target.
float focusDistanceOf(const Camera& camera);

/// Why a camera's view is undefined: which of its vectors is to blame, and the parts of a message about it.
struct ViewFault {
  enum class Blame { Up, Target, UpOrTarget };
  Blame blame = Blame::Up;
  std::string expected, got, hint;
};
/// None where position, target and up make a view: up is not zero, the target is not the position, and up is not
/// along the view (by 1e-6 of the sine; nearer, the picture's upright is rounding noise).
std::optional<ViewFault> viewFault(const Camera& camera);

}  // namespace mote
