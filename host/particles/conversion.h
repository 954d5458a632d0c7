// Particles from files of any format into one file of another: chosen, moved, thinned out, with a record of what the
// target could not hold.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/core/vec.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/particle_writer.h"

namespace mote {

struct ConversionOptions {
  OutputFormat format = OutputFormat::Prt1;
  WriteOptions write = {};
  /// Ours and theirs, in the order in which they are written; theirs may be empty: ours, or what other programs call it
  /// (our_channels.h). None: all, and what is one of ours under another name gets our name.
  std::vector<std::pair<std::string, std::string>> channels = {};
  bool keepNames = false;                        ///< all channels, but under their own names
  std::map<std::string, NumberType> types = {};  ///< by the name that is written
  float subsample = 1;                           ///< 0 < … ≤ 1: the particles that isSampled() takes (sampling.h)
  std::uint64_t seed = 0;                        ///< of that choice
  double scale = 1;                              ///< > 0; positions, velocities, radii
  dvec3 rotate{0}, translate{0};                 ///< degrees about x, then y, then z; order: scale, rotate, translate

  bool moves() const { return scale != 1 || rotate != dvec3(0) || translate != dvec3(0); }
};

struct WrittenChannel {
  Channel channel;            ///< as it stands in the file
  std::string from;           ///< its name in the (first) file that has it
  NumberType fromType{};      ///< that all inputs' numbers fit
  std::uint64_t changed = 0;  ///< numbers that are another one in the new type
  std::uint64_t filled = 0;   ///< particles of inputs that have no such channel
  double fill = 0;            ///< what they got
};

struct ConversionReport {
  std::string path, format;
  std::uint64_t read = 0, written = 0;  ///< particles
  std::uint64_t bytes = 0;              ///< of the file
  std::vector<WrittenChannel> channels;
  std::vector<std::string> lostMetadata;  ///< "CoordSys", "Position.Interpretation"
  std::vector<std::string> notes;         ///< sentences about anything else that a user should know
};

/// Writes the particles of all inputs, one after the other, to `path`. Channels are united: of several types one that
/// holds all numbers; where an input lacks one, its particles get 1 (Density, Color) or 0.
/// Throws InputError where an input has none of an asked channel, or lacks one that cannot be made up (Position,
/// Radius, ID, Absorption); where arities differ, or the path cannot be written; and as readers and writers do. Then
/// nothing is written. Inputs must be none of the path (callers check).
/// Memory: that of readBlocks (block_reader.h), some 10 MB more, and 8 bytes a particle for a sub-sample by ID.
ConversionReport convertParticles(std::span<const std::unique_ptr<ParticleFile>> inputs, const std::string& path,
                                  const ConversionOptions& options);

}  // namespace mote
