// Everything that is drawn of a frame: particles with their light, and what only full splats have (splat_scene.h).
#pragma once
#include <cstdint>
#include <vector>

#include "host/core/vec.h"
#include "shaders/glsl/layout/splat_scene.h"

namespace mote {

/// Arrays beside `particles` are of its length and in its order, or empty. Particles that cannot be seen may be left
/// out.
struct SplatSet {
  std::vector<layout::SplatParticle> particles;
  std::vector<vec3> extinction;  ///< factor on the optical depth of each colour; empty: 1
  std::vector<vec3> emission;    ///< radiance at the centre of a particle without extinction; empty: none
  std::vector<vec3> velocity;    ///< [scene units / s]; empty: at rest
  /// Which of the frame's receivers each particle is; empty: particle k is receiver k.
  std::vector<std::uint32_t> receiver;
  std::vector<vec4> spriteColor;     ///< rows from the top, A unused; empty: white
  std::vector<float> spriteOpacity;  ///< rows from the top; empty: 1
  /// Cameras, times and sizes of the sprites. Its addresses are for a device to fill.
  layout::SplatScene scene{};

  /// The camera of depths and sizes; with motion blur those of `scene` that open and close the shutter serve as well.
  const layout::SplatCamera& camera() const { return scene.camera; }
  /// True where rasterize() of splat.h, the fast way, draws the same.
  bool plain() const;
  std::size_t receiverOf(std::size_t k) const { return receiver.empty() ? k : receiver[k]; }
};

/// What a picture has beside radiance and A.
struct SplatLayers {
  bool depth = false, opticalDepth = false, velocity = false;
  bool colorAlpha = false;  ///< opacity of each colour: where the extinction differs between them
  bool any() const { return depth || opticalDepth || velocity || colorAlpha; }
};

}  // namespace mote
