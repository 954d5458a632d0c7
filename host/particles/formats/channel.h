// What any file of particles holds, whatever its format: channels of numbers, and values that are not of a particle.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "host/core/vec.h"
#include "host/particles/formats/number_type.h"

namespace mote {

/// One array of the particles.
struct Channel {
  std::string name;  ///< as the file has it
  NumberType type = NumberType::F32;
  std::uint32_t arity = 1;  ///< numbers a particle, ≥ 1
  double scale = 1;         ///< what 1 stands for, where integers are shares of their greatest number

  std::size_t bytes() const { return numberSize(type) * arity; }
};

/// Of one file. No program comes near, and whoever looks for a channel by its name goes through them all: a few bytes
/// that claim millions would cost hours, and thousands still a tenth of a second.
constexpr std::size_t kMostChannels = 1024;
/// Throws InputError where a file is about to have more.
void requireFewChannels(const std::string& path, std::uint64_t count);

/// Metadata only: UTF-8 text.
constexpr std::int32_t kMetadataText = -1;

/// A value of the file or of one of its channels, raw, so that a writer can give it back unchanged.
struct Metadata {
  std::string channel;                ///< empty: of the whole file
  std::string name;                   ///< …
  std::int32_t type = kMetadataText;  ///< a NumberType, or kMetadataText
  std::string bytes;                  ///< little-endian numbers; or the text, without a terminating NUL

  static Metadata text(std::string channel, std::string name, std::string text);
  static Metadata int32(std::string channel, std::string name, std::int32_t value);
  static Metadata float64(std::string channel, std::string name, double value);
  static Metadata float64s(std::string channel, std::string name, const std::vector<double>& values);
  static Metadata float32s(std::string channel, std::string name, const std::vector<float>& values);
};

/// Takes a channel's raw numbers as they are read, particle after particle in any number of pieces.
using RawTaker = std::function<void(std::vector<std::byte>&& piece)>;

/// A channel to read and where to put it: the vector is cleared, then gets one entry a particle.
///   float, double, uint64   a channel of arity 1
///   vec3, dvec3             arity 3 or more (the first three numbers), or 1 (the number three times)
///   std::byte               any: the raw numbers, Channel::bytes() a particle, little-endian
///   RawTaker                any: the same, in pieces, so that a file need not fit in memory (block_reader.h)
/// Numbers are converted as numbers (uint8 255 becomes 255.0f); for uint64, signed integers keep their bits and
/// floats are cut to integers, 0 where they are negative or not numbers. All but raw numbers are multiplied with
/// Channel::scale.
struct ChannelRequest {
  std::string channel;
  std::variant<std::vector<float>*, std::vector<double>*, std::vector<vec3>*, std::vector<dvec3>*,
               std::vector<std::uint64_t>*, std::vector<std::byte>*, RawTaker*>
      target;
};

/// "Position (3 × float32), Density (float32)", for messages.
std::string describeChannels(std::span<const Channel> channels);

}  // namespace mote
