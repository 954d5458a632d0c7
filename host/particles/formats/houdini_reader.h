// Reads Houdini's geometry of version 12 and later: .geo (JSON) and .bgeo (the same in a binary encoding), plain,
// packed with gzip or as .sc (Blosc). What older versions wrote is bgeo_reader.h's.
//
// Channels are the numeric attributes of points: P, v, Cd, pscale … Texts, groups, vertices and primitives are stepped
// over; software, date and global attributes that are numbers or one text are metadata.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/houdini_outline.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/unpacked_file.h"

namespace mote {

/// Anything in Blosc's packing is taken for one; what is in it is seen when it is opened.
bool beginsAsHoudini(std::span<const std::byte> start);

class HoudiniReader : public ParticleFile {
 public:
  /// Goes through the whole file, stepping over numbers. Throws InputError on any breach of JSON or of the geometry's
  /// schema outside of the numbers, and where points would take more than deflate could make of the file's bytes.
  explicit HoudiniReader(std::string path);

  /// Reads the arrays of the channels asked for, in the file's order. Cost: 0.9 GB/s of binary files, 50 MB/s of text;
  /// of gzip all is unpacked once more, at 0.2 GB/s.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  mutable UnpackedFile file_;  ///< where it stands is nobody's business
  bool binary_ = false;
  std::vector<HoudiniAttribute> attributes_;
};

}  // namespace mote
