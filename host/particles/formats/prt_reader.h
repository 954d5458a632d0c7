// Reads PRT 1.0 and 1.1 files: the header checked whole, then any channels converted in one pass over the zlib stream.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/prt_format.h"
#include "host/particles/formats/salvage.h"

namespace mote {

/// Whether a file that begins so is PRT 1.x, or means to be.
bool beginsAsPrt(std::span<const std::byte> start);

class PrtReader : public ParticleFile {
 public:
  /// Opens the file and checks everything in front of the particles. Throws InputError naming file, field and value.
  /// Also refused: a count whose particles could not possibly come out of the bytes that follow (zlib expands at most
  /// 1032 times), so that nothing is ever allocated on the header's word alone.
  explicit PrtReader(std::string path) : PrtReader(std::move(path), nullptr) {}

  /// For repair: the whole particles of a file that was not closed, or whose data are cut off or damaged, which is
  /// found out by unpacking all of them. Throws InputError as above where the header itself is wrong.
  PrtReader(std::string path, WhatIsWrong& wrong) : PrtReader(std::move(path), &wrong) {}

  const PrtHeader& header() const { return header_; }

  /// Data behind the last particle are a warning. Cost: that of zlib, about 0.3 GB/s of particles.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  PrtReader(std::string path, WhatIsWrong* salvage);
  void countWhole(WhatIsWrong& wrong, bool countKnown);

  InputFile file_;
  PrtHeader header_;
  std::uint64_t dataBegin_ = 0;
  bool partial_ = false;  ///< salvaged: nothing is expected behind the last particle
};

}  // namespace mote
