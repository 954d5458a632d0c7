// Reads tables in text: CSV and the like, with or without a header.
//
// Columns are parted by commas, semicolons, tabs or blanks, whichever the first line has, in that order; lines that are
// empty or begin with # are left out. The first line is a header where it is not all numbers: names, quoted or not, and
// as Krakatoa has them with a type before ("float64 Position"); neighbours of one name are one channel. Without a type
// a column is float64. Without a header columns are called as those of a plain array (component_names.h).
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/component_names.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"

namespace mote {

/// Whether it is text with a line of at least three numbers, perhaps behind a header.
bool beginsAsTable(std::span<const std::byte> start);

class CsvReader : public ParticleFile {
 public:
  /// Goes through the file once, to count its lines. Throws InputError on a header that makes no channels.
  explicit CsvReader(std::string path);

  /// Throws InputError naming line and column where something is not a number, or a line has more or fewer than the
  /// first. Cost: about 60 MB/s.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  void setColumns(const std::string& first);

  InputFile file_;
  char separator_ = ',';  ///< ' ': blanks and tabs, any number of them
  bool hasHeader_ = false;
  std::vector<PlacedChannel> columns_;  ///< each by itself
  std::vector<PlacedChannel> placed_;
  std::size_t rowBytes_ = 0;
};

}  // namespace mote
