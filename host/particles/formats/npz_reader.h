// Reads NPZ files: what numpy.savez and numpy.savez_compressed write, a zip of arrays in NPY's format.
//
// Arrays as long as the one of positions are channels of their members' names; the fields of a structured array are
// channels of their own names; three arrays that are a vector by their names (x, y, z) are one channel
// (component_names.h). Positions are the first array under a name that our_channels.h knows, x, y and z, or the first
// of three or more columns; they say how many particles there are. A single array that numpy named (arr_0) is read as
// an NPY file is. Scalars and arrays of up to 16 numbers that are of another length are metadata. Everything else is
// left out, with one warning that says what and why: Python objects (pickle) above all, which are never unpacked.
#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/npy_header.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/zip_file.h"

namespace mote {

class ChannelSink;

bool beginsAsNpz(std::span<const std::byte> start);

class NpzReader : public ParticleFile {
 public:
  /// Throws InputError on any breach of zip's or NPY's format, where no array can be positions, and where a shape asks
  /// for more than its member has.
  explicit NpzReader(std::string path);

  /// Cost: that of reading the members asked for, or zlib's, about 0.2 GB/s of numbers. A packed array in Fortran's
  /// order is held in memory while it is read.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  /// A member that is an array.
  struct Array {
    std::size_t member = 0;
    std::string name;  ///< without ".npy"
    NpyArray header;
    NpyTable table;                ///< of those that have channels
    std::size_t virtualBegin = 0;  ///< of its rows, were those of all tables side by side
  };
  /// Where a channel is: in one array, or in three, one after another.
  struct Place {
    std::size_t array = 0, arrays = 1;
    std::size_t offset = 0;  ///< in a row of the first
  };

  void openArrays();
  const Array& positions() const;
  [[noreturn]] void refusePositions() const;
  void takeTables();
  void setChannels();
  void keepMetadata(ZipStream& stream, const Array& array);
  void leaveOut(const Array& array, const std::string& reason);
  void readPlace(const Place& place, std::vector<ChannelSink*>& sinks) const;

  ZipFile file_;
  std::vector<Array> arrays_;  ///< in the archive's order
  std::vector<Place> places_;  ///< of channels_
  std::string leftOut_;
};

}  // namespace mote
