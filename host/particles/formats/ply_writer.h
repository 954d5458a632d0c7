// Writes PLY files (ply_reader.h): an element `vertex` with a property for each number of a particle, little-endian or
// as text.
#pragma once
#include <string>
#include <vector>

#include "host/particles/formats/particle_writer.h"

namespace mote {

/// A channel of arity 1 is a property of its name; Position is x y z, Velocity vx vy vz, Normal nx ny nz, Color red
/// green blue; others of arity 3 are NAME_x NAME_y NAME_z, those of any other arity NAME[0] NAME[1] … What is not
/// printed in a name, blanks too, is '_'. PLY has neither float16 nor integers of 64 bits (particle_writer.h).
Channel plyChannel(const Channel& channel);

class PlyWriter : public ParticleWriter {
 public:
  /// Throws InputError where two properties would have one name.
  PlyWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>& metadata,
            const WriteOptions& options);

 private:
  void writeRows(std::span<const std::byte> rows, std::size_t count) override;
  void complete() override;
  std::string header(std::uint64_t count) const;

  bool text_;
  std::vector<std::string> properties_;  ///< "property float x"
};

}  // namespace mote
