// What of a VTK XML file is XML: its tags, without the numbers between and behind them.
#pragma once
#include <cstdint>
#include <string>

#include "host/particles/formats/input_file.h"

namespace mote {

/// Stays small however long the arrays are, so that an XML library may have it whole.
struct VtkXmlMarkup {
  /// Well-formed where the file is. Comments are left out, and every text that is not blank is "BEGIN END", the place
  /// of its bytes in the file.
  std::string xml;
  /// The first byte behind the '_' of AppendedData, whose content need not be text at all; 0: there is none. What
  /// follows is not in `xml`, which closes the tags by itself.
  std::uint64_t appended = 0;
};

/// Goes through the file once, up to its AppendedData. Throws InputError where a tag does not end, AppendedData has no
/// '_', or the tags take more than 8 MiB.
VtkXmlMarkup readVtkXmlMarkup(const InputFile& file);

}  // namespace mote
