// Light on the solids that a picture shows: Lambert's law, through the medium and past other solids (thesis §5.2).
#pragma once
#include <vector>

#include "engine/lighting.h"
#include "host/solids/surfaces.h"

namespace mote {

/// What one light does to each surface of the picture.
struct SurfaceLight {
  std::vector<vec3> radiance;  ///< albedo / π · E · cos θ · T · S [W/(m² sr)]; 0 on the side away from the light
  std::vector<float> shadow;   ///< T · S, mean of the colours, 0–1; 1 where the solid receives no shadows
};

/// T is taken at one point of a surface in a pixel, S, which has sharp edges, is the mean over its shadow points.
SurfaceLight lightSurfaces(const Frame& frame, const Scene& scene, const Surfaces& surfaces, const layout::Light& light,
                           const ShadowSources& sources);

}  // namespace mote
