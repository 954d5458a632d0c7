// Writes PRT 1.1 and 1.0 files, compressed in parallel, whole or not at all.
//
// Reference: prt_format.h. The box of the positions (`BoundBox`) is always written, and from the particles.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/core/vec.h"
#include "host/particles/formats/particle_writer.h"
#include "host/particles/formats/prt_format.h"
#include "host/particles/formats/row_box.h"
#include "host/particles/particle_set.h"

namespace mote {

/// What a channel is in PRT 1.x: its name [A-Za-z_][A-Za-z0-9_]{0,30}, a Position of floats float32.
Channel prtChannel(const Channel& channel);
/// PRT 2's names and values as PRT 1.x has them; false for what is too long for it.
bool storePrtMetadata(Metadata& value);

class PrtWriter : public ParticleWriter {
 public:
  /// The names must be PRT's (else a bug). Version 1.0 has no metadata: they are left out.
  PrtWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>& metadata,
            const WriteOptions& options, int minorVersion = 1);

 private:
  void writeRows(std::span<const std::byte> rows, std::size_t count) override;
  void complete() override;
  void deflatePending(bool last);

  int level_, minorVersion_;
  RowBox box_;
  std::uint64_t boxAt_ = 0;         ///< where the header has it
  std::vector<std::byte> pending_;  ///< rows that are not yet deflated
  std::uint32_t adler_ = 1;         ///< zlib's checksum so far
};

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
  int level = 1;         ///< zlib's 0 to 9 (WriteOptions)
};

/// Writes one PRT file of arrays that stand in memory. There must be a Position of 3 × float32, all columns of the same
/// length and with different names (checked: these are bugs of the caller). `BoundBox` is always written, from the
/// positions; metadata of channels that are not written are left out. The bytes do not depend on the number of threads.
/// Throws InputError where the path cannot be written or a channel's name is none for PRT, MachineError where the disk
/// refuses; then nothing is left behind.
void writePrt(const std::string& path, std::span<const PrtColumn> columns, std::span<const Metadata> metadata = {},
              const PrtWriteOptions& options = {});

/// The set's own channels, in this order: Position, Radius, Density, and where it has them Color, Absorption, Emission,
/// Velocity, ID.
std::vector<PrtColumn> columnsOf(const ParticleSet& set);

}  // namespace mote
