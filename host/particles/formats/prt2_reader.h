// Reads PRT 2 and SPRT files: what Krakatoa's makers wrote after PRT 1, as their open code implements it. All numbers
// little-endian; a file is chunks, its particles streams of blocks that are compressed each by itself.
//
// Of several streams (an SPRT's levels of detail) the one without a name is read, else the one with most particles.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/salvage.h"

namespace mote {

bool beginsAsPrt2(std::span<const std::byte> start);

class Prt2Reader : public ParticleFile {
 public:
  /// Throws InputError on any breach of the format in front of the particles and in the chunks' order and sizes; on a
  /// stream that was not closed.
  explicit Prt2Reader(std::string path) : Prt2Reader(std::move(path), nullptr) {}

  /// For repair: the particles of all whole blocks in front of the first that is cut off or damaged, whatever counts
  /// and index say; all of them are unpacked to find out. Throws InputError where there is no stream of particles.
  Prt2Reader(std::string path, WhatIsWrong& wrong) : Prt2Reader(std::move(path), &wrong) {}

  /// Cost: that of zlib, about 0.3 GB/s of particles, or of LZ4, some GB/s.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  struct Stream {
    std::string name, compression;
    std::uint64_t particles = 0, blocks = 0;
    std::uint64_t begin = 0, end = 0;  ///< of its blocks in the file
    bool offsets = false;              ///< blocks have an offset of their positions
    bool transposed = false, deflated = false, lz4 = false;
    bool packed() const { return deflated || lz4; }
  };
  class Chunk;
  struct Block;

  Prt2Reader(std::string path, WhatIsWrong* salvage);
  bool readChunk(std::uint64_t& at, std::vector<Stream>& streams, std::vector<std::string>& indexed, bool salvage);
  void readChannels(Chunk& chunk);
  void readMetadata(Chunk& chunk);
  Stream readStream(Chunk& chunk, bool offsets, bool salvage) const;
  void checkIndex(Chunk& chunk, std::span<const Stream> streams, std::vector<std::string>& indexed) const;
  void choose(std::span<const Stream> streams, std::span<const std::string> indexed, WhatIsWrong* salvage);
  void countWhole(WhatIsWrong& wrong);
  void readBlock(Chunk& blocks, std::uint64_t done, Block& block) const;

  InputFile file_;
  Stream stream_;
  std::vector<std::size_t> offsets_;  ///< of the channels in a particle [bytes]
  std::size_t particleBytes_ = 0;
  /// With offsets: which channel is Position, and its type in the file; it is float64 for who reads it.
  std::size_t position_ = ~std::size_t{0};
  NumberType storedPosition_ = NumberType::F32;
};

}  // namespace mote
