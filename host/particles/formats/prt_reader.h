// Reads PRT 1.0 and 1.1 files: the header checked whole, then any channels converted in one pass over the zlib stream.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/prt_format.h"

namespace mote {

/// Whether a file that begins so is PRT 1.x, or means to be.
bool beginsAsPrt(std::span<const std::byte> start);

class PrtReader : public ParticleFile {
 public:
  /// Opens the file and checks everything in front of the particles. Throws InputError naming file, field and value.
  /// Also refused: a count whose particles could not possibly come out of the bytes that follow (zlib expands at most
  /// 1032 times), so that nothing is ever allocated on the header's word alone.
  explicit PrtReader(std::string path);

  const PrtHeader& header() const { return header_; }

  /// Data behind the last particle are a warning. Cost: that of zlib, about 0.3 GB/s of particles.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  InputFile file_;
  PrtHeader header_;
  std::uint64_t dataBegin_ = 0;
};

}  // namespace mote
