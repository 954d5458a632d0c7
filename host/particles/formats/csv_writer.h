// Writes CSV with Krakatoa's header: every column's type and name, a channel's columns side by side
// ("float32 Position,float32 Position,float32 Position,float16 Density").
#pragma once
#include <string>
#include <vector>

#include "host/particles/formats/particle_writer.h"

namespace mote {

/// Any type and arity; a comma or what is not printed in a name is '_'.
Channel csvChannel(const Channel& channel);

class CsvWriter : public ParticleWriter {
 public:
  CsvWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>& metadata,
            const WriteOptions& options);

 private:
  void writeRows(std::span<const std::byte> rows, std::size_t count) override;
  void complete() override {}
};

}  // namespace mote
