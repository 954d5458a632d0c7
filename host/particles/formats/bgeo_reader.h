// Reads classic BGEO files, version 5: Houdini's up to 11, what it calls .bhclassic since, and those of Partio, which
// simulations write (SPlisHSPlasH, OpenVDB's tools). Big-endian; plain or packed with gzip.
//
// Points have a place of four numbers, of which Position is the first three, and attributes of floats, vectors or
// integers; texts, which are numbers of a list, are left out, and so are primitives and everything behind the points.
#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/component_names.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"

namespace mote {

bool beginsAsBgeo(std::span<const std::byte> start);

class BgeoReader : public ParticleFile {
 public:
  /// Throws InputError on any breach of the format in front of the points.
  explicit BgeoReader(std::string path);

  /// Cost: that of reading the file, or zlib's, about 0.3 GB/s of points.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  GzipFile file_;
  std::vector<PlacedChannel> placed_;
  std::size_t rowBytes_ = 0;
  std::uint64_t dataBegin_ = 0;
};

}  // namespace mote
