// Parses and checks the header of a PRT 1.x file (used by PrtReader only).
#pragma once
#include <cstdint>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/prt_format.h"

namespace mote {

struct ParsedPrtHeader {
  PrtHeader header;
  bool countKnown = true;       ///< false: the file was not closed, count is 0
  std::uint64_t dataBegin = 0;  ///< where the zlib stream starts [bytes from the file's start]
};

/// Throws InputError on any breach of the format; `salvage`: but not where the number of particles was never written.
/// Allocates no more than the header's own bytes in the file.
ParsedPrtHeader parsePrtHeader(const InputFile& file, bool salvage = false);

}  // namespace mote
