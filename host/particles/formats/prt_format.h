// What a PRT 1.0 or 1.1 file says before its particles: types, channels and metadata as plain data.
// Format: reference "PRT file format" of Krakatoa's makers, as their open code implements it. All numbers
// little-endian.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/particles/formats/channel.h"

namespace mote {

/// A channel, and where it stands in a packed particle. Names are [A-Za-z_][A-Za-z0-9_]{0,30}.
struct PrtChannel : Channel {
  std::uint32_t offset = 0;  ///< of its first number [bytes]
};

/// Everything in front of the zlib stream.
struct PrtHeader {
  int minorVersion = 1;              ///< 0 or 1: PRT 1.0 or 1.1
  std::uint64_t count = 0;           ///< particles
  std::vector<PrtChannel> channels;  ///< in the file's order; no two overlap
  std::vector<Metadata> metadata;    ///< file and channel values; (channel, name) is unique
  std::size_t particleBytes = 0;     ///< of one packed particle, gaps included

  /// Null where the file has none of that name (names are case-sensitive).
  const PrtChannel* channel(std::string_view name) const;
  /// Null where there is none; channel "" is the file.
  const Metadata* meta(std::string_view channel, std::string_view name) const;
};

/// True for [A-Za-z_][A-Za-z0-9_]{0,30}.
bool prtNameIsValid(std::string_view name);

constexpr unsigned char kPrtMagic[8] = {0xC0, 'P', 'R', 'T', '\r', '\n', 0x1A, '\n'};
constexpr char kPrtSignature[32] = "Extensible Particle Format";
constexpr std::size_t kPrtFixedHeader = 56;    ///< bytes up to the metadata
constexpr std::size_t kPrtChannelRecord = 44;  ///< bytes of a channel record that we know

}  // namespace mote
