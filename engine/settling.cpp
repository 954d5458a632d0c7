#include "engine/settling.h"

#include "engine/frame.h"
#include "host/core/error.h"
#include "host/core/log.h"

namespace mote {

bool leavesOpen(const Scene& scene) {
  const Camera& camera = scene.camera;
  return camera.fitted || camera.fittedDepths || camera.fittedHeight || scene.defaultLights ||
         scene.medium.opticalDepth || scene.lighting.autoSubsample;
}

std::optional<int> settleByShot(Scene& scene, std::optional<int> before) {
  if (!leavesOpen(scene)) return {};
  const Frames& shot = scene.wholeShot();
  std::vector<std::string> dropped;
  const WarningsKept kept(dropped);
  for (int number = shot.first; number <= shot.last && number != before; number += shot.step) {
    try {
      FrameStats ignored;
      prepareFrame(scene, number, ignored);
      return number;
    } catch (const InputError&) {
      // Whoever draws it says so. Every part of the shot goes on to the same frame.
    }
  }
  return {};
}

}  // namespace mote
