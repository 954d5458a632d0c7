// Reads legacy VTK files, text and binary (big-endian), versions 1 to 5: the points of a POLYDATA or UNSTRUCTURED_GRID
// and what POINT_DATA has of them ("VTK File Formats", Kitware). Cells and their data are stepped over, as are lookup
// tables, tensors and arrays of texts or bits.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/byte_stream.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"

namespace mote {

bool beginsAsVtk(std::span<const std::byte> start);

class VtkReader : public ParticleFile {
 public:
  /// Goes through the file once. Throws InputError on any breach of the format, and on grids, which have no particles.
  explicit VtkReader(std::string path);

  /// Cost: that of reading a binary file; text some 30 MB/s.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  void parse();
  [[noreturn]] void fail(const ByteStream& bytes, const std::string& expected, const std::string& got) const;
  std::uint64_t number(ByteStream& bytes, const char* what) const;
  /// Steps over `count` numbers; `type` as the file names it. Returns where they begin.
  std::uint64_t skip(ByteStream& bytes, const std::string& type, std::uint64_t count) const;
  void keep(ByteStream& bytes, std::string name, const std::string& type, std::uint64_t arity, bool ofPoints,
            std::uint64_t tuples);

  InputFile file_;
  bool binary_ = false;
  int version_ = 0;
  std::vector<std::uint64_t> begins_;  ///< where each channel's numbers stand, one behind the other
};

}  // namespace mote
