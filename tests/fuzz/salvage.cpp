// What can be saved of a damaged PRT file. What salvageParticles promises is there: reading it refuses nothing.
#include "host/particles/formats/salvage.h"

#include "tests/fuzz/fuzz.h"

namespace mote::fuzz {

void lookAt(const std::string& path, std::span<const std::byte>) {
  Salvaged salvaged;
  mayRefuse(path, [&] { salvaged = salvageParticles(path); });
  if (salvaged.file) readRaw(*salvaged.file);
}

}  // namespace mote::fuzz
