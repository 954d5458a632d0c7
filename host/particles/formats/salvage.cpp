#include "host/particles/formats/salvage.h"

#include <fmt/format.h>

#include "host/core/error.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/prt2_reader.h"
#include "host/particles/formats/prt_reader.h"

namespace mote {
namespace {

constexpr std::size_t kStart = 64;

template <class Reader>
Salvaged open(const std::string& path) {
  Salvaged salvaged;
  try {
    salvaged.file = std::make_unique<Reader>(path, salvaged.wrong);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}; there is nothing to save", error.what()));
  }
  return salvaged;
}

}  // namespace

Salvaged salvageParticles(const std::string& path) {
  const std::vector<std::byte> start = InputFile(path).start(kStart);
  if (beginsAsPrt2(start)) return open<Prt2Reader>(path);
  if (beginsAsPrt(start)) return open<PrtReader>(path);
  throw InputError(path, "", "a PRT file, the only kind that is repaired",
                   start.empty()          ? "an empty file"
                   : isParticleFile(path) ? "another format"
                                          : "no particle file",
                   "mote info says what is wrong with it");
}

}  // namespace mote
