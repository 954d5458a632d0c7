// Fourier opacity maps (Jansen and Bavoil, "Fourier Opacity Mapping", I3D 2010) for particles lit by one light.
//
// Each texel of a map before the light holds the Fourier coefficients of the extinction along its ray, over the depth
// from the nearest to the farthest particle. A particle at depth d adds τ cos 2πkd and τ sin 2πkd to the texels that
// its kernel covers; the optical depth up to any depth is the integral of the series, looked up bilinearly.
#pragma once
#include <vector>

#include "host/lighting/lighting.h"

namespace mote {

struct FourierMapOptions {
  int size = 128;     ///< texels along the longer side, 16 … 4096
  int harmonics = 7;  ///< of the series beside its mean: 3, 7, 15, 31 or 63, which fill vectors; 2 numbers each
  bool thick = true;  ///< particles are chords in depth; false: points, as in the paper
};

/// Optical depth from every slot toward the light, before shadowDensity, for falloff smooth and one channel. What the
/// paper leaves to whoever writes it: kernels are scaled such that their samples at the texels keep their integral and
/// narrowed by half of what the interpolation widens them, none is narrower than a texel, and a particle's own share is
/// taken off its sum again. Splats go by tiles of 16 × 16 texels, all on TBB and Google Highway. Throws InputError for
/// a point light that does not lie outside of the particles. Beside map and result 32 bytes a particle and 4 for each
/// tile that it touches.
std::vector<float> fourierMapDepths(const Octree& tree, const layout::Light& light, const FourierMapOptions& options);

/// Bytes of the map, at most: of a square one.
std::size_t fourierMapBytes(const FourierMapOptions& options);

}  // namespace mote
