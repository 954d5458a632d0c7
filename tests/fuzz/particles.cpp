// A format of particles, read raw and as a scene reads it. MOTE_FUZZ_BEGINS recognises the format; it is declared in
// MOTE_FUZZ_HEADER.
#include MOTE_FUZZ_HEADER

#include "host/particles/formats/input_file.h"
#include "host/particles/our_channels.h"
#include "host/particles/source_reader.h"
#include "tests/fuzz/fuzz.h"

namespace mote::fuzz {
namespace {

constexpr std::size_t kStart = 1 << 16;  ///< as openParticleFile
constexpr std::uint64_t kMostDrawn = 100;

bool isOurs(std::span<const std::byte> bytes) {
  return beginsAsGzip(bytes) ? MOTE_FUZZ_BEGINS(unpackedStart(bytes, kStart)) : MOTE_FUZZ_BEGINS(bytes);
}

}  // namespace

void lookAt(const std::string& path, std::span<const std::byte> bytes) {
  if (!isOurs(bytes)) return;  // another target's
  ParticleSource source;
  source.file = path;
  mayRefuse(path, [&] {
    std::unique_ptr<ParticleFile> file = openParticleFile(path);
    if (file->drawn() && file->count() > kMostDrawn) {  // a few bytes hold a million voxels
      source.count = kMostDrawn;
      file = openParticleFile(path, samplingOf(source));
    }
    readRaw(*file);
  });
  mayRefuse(path, [&] { readSource(source, path, 24); });
}

}  // namespace mote::fuzz
