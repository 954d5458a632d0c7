// Parses and checks the header of a PRT 1.x file (used by PrtReader only).
#pragma once
#include <cstdint>
#include <cstdio>
#include <string>

#include "host/particles/formats/prt_format.h"

namespace mote {

struct ParsedPrtHeader {
  PrtHeader header;
  std::uint64_t dataBegin = 0;  ///< where the zlib stream starts [bytes from the file's start]
};

/// Reads from the start of `file`, which holds `fileBytes` bytes. Throws InputError (place: `path`) on any breach of
/// the format. Allocates no more than the header's own bytes in the file.
ParsedPrtHeader parsePrtHeader(const std::string& path, std::FILE* file, std::uint64_t fileBytes);

}  // namespace mote
