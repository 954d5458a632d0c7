// Writes PRT 1.1 and 1.0 files, compressed in parallel, whole or not at all.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/core/vec.h"
#include "host/particles/formats/prt_format.h"
#include "host/particles/particle_set.h"

namespace mote {

/// One channel as it stands in memory, tightly packed; the caller keeps the array alive while it is written.
struct PrtColumn {
  std::string name;  ///< [A-Za-z_][A-Za-z0-9_]{0,30}
  NumberType type = NumberType::F32;
  std::uint32_t arity = 1;
  std::span<const std::byte> bytes;  ///< particles × arity numbers of `type`

  static PrtColumn of(std::string name, std::span<const float> values);          ///< float32
  static PrtColumn of(std::string name, std::span<const vec3> values);           ///< 3 × float32
  static PrtColumn of(std::string name, std::span<const std::uint64_t> values);  ///< uint64
  static PrtColumn raw(std::string name, NumberType type, std::uint32_t arity, std::span<const std::byte> values);
};

struct PrtWriteOptions {
  int minorVersion = 1;  ///< 1: PRT 1.1; 0: PRT 1.0, which has no metadata (they are left out)
  int level = 1;  ///< zlib's 0 to 9; 1 M cloud particles: 1 gives 15.70 MB in 0.44 core-seconds, 6 gives 15.64 in 1.20
};

/// Writes one PRT file through an OutputFile. There must be a Position of 3 × float32, all columns of the same length
/// and with different names (checked: these are bugs of the caller). `BoundBox` is always written, from the positions;
/// metadata of channels that are not written are left out. The bytes do not depend on the number of threads.
/// Throws InputError where the path cannot be written or a channel's name is none for PRT, MachineError where the disk
/// refuses; then nothing is left behind.
void writePrt(const std::string& path, std::span<const PrtColumn> columns, std::span<const Metadata> metadata = {},
              const PrtWriteOptions& options = {});

/// The set's own channels, in this order: Position, Radius, Density, and where it has them Color, Absorption, Emission,
/// Velocity, ID.
std::vector<PrtColumn> columnsOf(const ParticleSet& set);

}  // namespace mote
