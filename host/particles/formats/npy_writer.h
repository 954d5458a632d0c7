// Writes NPY files that numpy.load gives as a structured array: a field for each channel (npy_reader.h).
#pragma once
#include <string>
#include <vector>

#include "host/particles/formats/particle_writer.h"

namespace mote {

/// Any name, type and arity.
Channel npyChannel(const Channel& channel);

class NpyWriter : public ParticleWriter {
 public:
  /// Version 1.0; 2.0 where the fields need more than 64 kB, 3.0 where a name is not ASCII.
  NpyWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>& metadata,
            const WriteOptions& options);

 private:
  void writeRows(std::span<const std::byte> rows, std::size_t count) override;
  void complete() override;
  std::string header(std::uint64_t count) const;
};

}  // namespace mote
