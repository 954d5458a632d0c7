// A frame's picture: splats and solids together, with every layer that was asked for.
#pragma once
#include <functional>
#include <vector>

#include "engine/lighting.h"
#include "engine/rasterizer.h"
#include "engine/surface_light.h"
#include "host/image/image.h"
#include "host/solids/surfaces.h"

namespace mote {

/// What the scene wants beside radiance and A.
SplatLayers pictureLayers(const Frame& frame, const Scene& scene);

/// Draws the medium before, beside and between the surfaces, and lays both over each other, each with its share of the
/// pixel:
///   radiance Σ coverage · (medium before the surface + (1 − its α) · surface);   α likewise, holdouts counting as 0
///   Z                the nearest of the medium's and of shaded surfaces' depths
///   optical_depth    of the medium up to the surface, weighted by coverage
///   velocity         of medium and shaded surfaces, weighted by what each adds to α
///   shadow.<light>   T · S at the surfaces, weighted by coverage; 1 where there is none. Holdouts have it as well
///   light.<name>.*   the picture by one light alone; `emission.*` what the particles give out. Their sum is the
///   picture
/// `surfaceLights` are the lights on the surfaces, one a light of the frame, none
/// where there are no surfaces. The seconds of laying surfaces and medium over each other go to stats' "solids"; the
/// rasteriser counts its own.
Image makePicture(const Frame& frame, const Scene& scene, const LitParticles& lit, const Surfaces& surfaces,
                  std::vector<SurfaceLight> surfaceLights, Rasterizer& rasterizer, FrameStats& stats);

}  // namespace mote
