// Which splats are small on the picture: a device draws those in a cheaper way (engine/passes/splat_pass.h).
#pragma once
#include <cstdint>
#include <span>

#include "host/splat/splat.h"

namespace mote {

/// Of the particles in back-to-front order (sortByDepth), the number that come before the first whose rectangle of
/// pixels is wider or higher than `side` [pixels]. Parallel, some 5 ns a particle where all are small.
std::uint32_t smallSplatsFirst(std::span<const layout::SplatParticle> particles, const layout::SplatCamera& camera,
                               float keyScale, float side);

}  // namespace mote
