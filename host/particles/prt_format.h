// What a PRT 1.0 or 1.1 file says before its particles: types, channels and metadata as plain data.
// Format: reference "PRT file format" of Krakatoa's makers, as their open code implements it. All numbers
// little-endian.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mote {

/// The number type of a channel or of a metadata value, numbered as in the file.
enum class PrtType : std::int32_t { I16, I32, I64, F16, F32, F64, U16, U32, U64, I8, U8 };
constexpr std::int32_t kPrtTypes = 11;
/// Metadata only: UTF-8 text.
constexpr std::int32_t kPrtText = -1;

/// Bytes of one number: 1, 2, 4 or 8.
std::size_t prtTypeSize(PrtType type);
/// "float32", "int8", …
std::string_view prtTypeName(PrtType type);

/// One array of the particles.
struct PrtChannel {
  std::string name;  ///< [A-Za-z_][A-Za-z0-9_]{0,30}
  PrtType type = PrtType::F32;
  std::uint32_t arity = 1;   ///< numbers a particle, ≥ 1
  std::uint32_t offset = 0;  ///< of the first one in the packed particle [bytes]

  std::size_t bytes() const { return prtTypeSize(type) * arity; }
};

/// One value of a 1.1 file, raw, so that a writer can give it back unchanged.
struct PrtMetadata {
  std::string channel;           ///< empty: of the whole file
  std::string name;              ///< 1 to 31 characters
  std::int32_t type = kPrtText;  ///< a PrtType, or kPrtText
  std::string bytes;             ///< little-endian numbers; or the text, without a terminating NUL

  static PrtMetadata text(std::string channel, std::string name, std::string text);
  static PrtMetadata int32(std::string channel, std::string name, std::int32_t value);
  static PrtMetadata float64(std::string channel, std::string name, double value);
  static PrtMetadata float32s(std::string channel, std::string name, const std::vector<float>& values);
};

/// Everything in front of the zlib stream.
struct PrtHeader {
  int minorVersion = 1;               ///< 0 or 1: PRT 1.0 or 1.1
  std::uint64_t count = 0;            ///< particles
  std::vector<PrtChannel> channels;   ///< in the file's order; no two overlap
  std::vector<PrtMetadata> metadata;  ///< file and channel values; (channel, name) is unique
  std::size_t particleBytes = 0;      ///< of one packed particle, gaps included

  /// Null where the file has none of that name (names are case-sensitive).
  const PrtChannel* channel(std::string_view name) const;
  /// Null where there is none; channel "" is the file.
  const PrtMetadata* meta(std::string_view channel, std::string_view name) const;
  /// "Position (3 × float32), Density (float32)", for messages.
  std::string describeChannels() const;
};

/// True for [A-Za-z_][A-Za-z0-9_]{0,30}.
bool prtNameIsValid(std::string_view name);

constexpr unsigned char kPrtMagic[8] = {0xC0, 'P', 'R', 'T', '\r', '\n', 0x1A, '\n'};
constexpr char kPrtSignature[32] = "Extensible Particle Format";
constexpr std::size_t kPrtFixedHeader = 56;    ///< bytes up to the metadata
constexpr std::size_t kPrtChannelRecord = 44;  ///< bytes of a channel record that we know

}  // namespace mote
