// Writes PRT 2 files (prt2_reader.h): one stream without a name, in blocks compressed each by itself and in parallel.
#pragma once
#include <string>
#include <vector>

#include "host/particles/formats/particle_writer.h"
#include "host/particles/formats/row_box.h"

namespace mote {

/// Any name, type and arity.
Channel prt2Channel(const Channel& channel);
/// PRT 1.x's names and values as PRT 2 has them.
bool storePrt2Metadata(Metadata& value);

class Prt2Writer : public ParticleWriter {
 public:
  /// Compression: transpose-zlib where the options say nothing, as its makers' programs. Throws InputError on one that
  /// PRT 2 has not, and on more channels than its header may hold (50,000 bytes).
  Prt2Writer(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>& metadata,
             const WriteOptions& options);

 private:
  struct Block;
  void writeRows(std::span<const std::byte> rows, std::size_t count) override;
  void complete() override;
  void writePending(bool last);
  Block packed(std::span<const std::byte> rows) const;

  int level_;
  bool transposed_ = false, deflated_ = false, lz4_ = false;
  RowBox box_;
  std::uint64_t chunkAt_ = 0, countsAt_ = 0;  ///< of the chunk of particles, and of its two counts
  std::uint64_t blocks_ = 0;
  std::string index_;               ///< an entry for each block
  std::vector<std::byte> pending_;  ///< rows that are not yet written
};

}  // namespace mote
