// What can be saved of a file that its reader refuses.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "host/particles/formats/particle_file.h"

namespace mote {

/// What is wrong with a file of which particles can be saved.
struct WhatIsWrong {
  std::string sentence;                   ///< empty: nothing
  std::optional<std::uint64_t> promised;  ///< particles that its header speaks of; none: it was never closed
};

struct Salvaged {
  std::unique_ptr<ParticleFile> file;  ///< its count is that of the whole particles, which read() gives
  WhatIsWrong wrong;
};

/// Opens a PRT file whatever state its particles are in: PRT 1.x to the last whole particle, PRT 2 to the last whole
/// block. Throws InputError on any other format, and where the header itself is cut off or damaged, so that nothing can
/// be saved. Cost: that of reading it once.
Salvaged salvageParticles(const std::string& path);

}  // namespace mote
