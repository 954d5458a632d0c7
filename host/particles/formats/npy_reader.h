// Reads NPY files, version 1.0 to 3.0: what numpy.save writes (npy_header.h).
//
// A structured array has a channel for each of its fields, with arity 3 for one of shape (3,); scalars that are a
// vector by their names become one channel (component_names.h). A plain array of shape (N, 3) is Position, (N, 4)
// Position and Density, (N, 6) Position and Velocity; further columns are Column3, Column4 …
#pragma once
#include <cstddef>
#include <span>
#include <string>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/npy_header.h"
#include "host/particles/formats/particle_file.h"

namespace mote {

bool beginsAsNpy(std::span<const std::byte> start);

class NpyReader : public ParticleFile {
 public:
  /// Throws InputError on any breach of the format; on arrays of objects, text, complex numbers or dates; and where the
  /// shape asks for more than the file has.
  explicit NpyReader(std::string path);

  /// Cost: that of reading the file.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  InputFile file_;
  NpyTable table_;
  std::uint64_t dataBegin_ = 0;
};

}  // namespace mote
