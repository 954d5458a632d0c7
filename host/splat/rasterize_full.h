// The reference rasteriser of full splats on TBB: lens, shutter, orthographic and anamorphic cameras, colours,
// emission, sprites, surfaces, layers. What needs none of these is drawn by rasterize() of splat.h, several times
// faster.
#pragma once
#include <span>

#include "host/image/image.h"
#include "host/splat/splat_set.h"
#include "host/splat/splats_done.h"

namespace mote {

/// Draws the particles in the order given, each over what is there. `surfaces`: the depth of an opaque surface at each
/// pixel, row by row, that hides what lies behind it (kNoDepth: none; layout::kPixelLeftOut: nothing is drawn there);
/// empty: none anywhere.
///
/// The picture's layers: depth (Z) as in splat.h, of the medium alone; optical depth, summed over all splats before the
/// surface; velocity of the splats' centres with the camera's, averaged over what is seen, weighted by what it adds to
/// A; alpha of each colour, and A their mean.
///
/// Does not depend on the number of threads. About 30 ns a splat and pixel of one core.
Image rasterizeFull(const SplatSet& set, std::span<const layout::uint> order, std::span<const float> surfaces,
                    SplatLayers layers, const SplatsDone& done = {});

/// What both rasterisers do to a finished picture: A as the mean of the colours, velocity per unit of opacity.
void finishLayers(Image& image);

}  // namespace mote
