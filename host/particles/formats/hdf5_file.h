// An HDF5 file as particles need it: groups, arrays of numbers of one or two dimensions, short attributes.
//
// libhdf5 runs in processes of its own (child_stream.h), one for all that stands in front of the numbers and one for
// each array, so that a damaged file, over which it may crash or never end, is an error like any other.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/channel.h"

namespace mote {

/// A dataset of shape (rows) or (rows, arity), of integers or floats of up to 8 bytes.
struct Hdf5Array {
  std::string name;                     ///< in its group
  NumberType type = NumberType::F32;    ///< what its numbers are given as; half as float
  std::uint64_t rows = 0;               ///< …
  std::uint32_t arity = 1;              ///< …
  bool stored = false;                  ///< its bytes in the file can hold so many numbers
  std::vector<std::string> otherFiles;  ///< a virtual dataset: the files that have its numbers

  std::size_t rowBytes() const { return numberSize(type) * arity; }
};

/// A group of the root, or the root itself, whose name is empty.
struct Hdf5Group {
  std::string name;
  std::vector<Hdf5Array> arrays;     ///< by name; datasets of other kinds are left out
  std::vector<Metadata> attributes;  ///< up to 64 numbers each, or a text
};

/// Where HDF5 begins in a file that begins so, which may have something else before it; start.size() where it is none.
std::size_t hdf5Begin(std::span<const std::byte> start);

/// Whether libhdf5 is in this build (CMake option MOTE_HDF5). Without it Hdf5File's constructor throws InputError.
bool hasHdf5();

/// Goes through the rows of an array once, in order.
class Hdf5Rows {
 public:
  virtual ~Hdf5Rows() = default;
  /// Puts the next rows, arity numbers each, little-endian, in place of what `rows` holds, and says how many they are;
  /// 0 behind the last. Throws InputError where they are damaged.
  virtual std::size_t next(std::vector<std::byte>& rows) = 0;
};

class Hdf5File {
 public:
  /// Throws InputError where it is none, is cut off or damaged.
  explicit Hdf5File(std::string path);

  /// The root first, then its groups by name.
  const std::vector<Hdf5Group>& groups() const { return groups_; }
  /// Null where there is none of that name.
  const Hdf5Group* group(const std::string& name) const;

 private:
  std::string path_;
  std::vector<Hdf5Group> groups_;
};

/// The rows of an array of that file, as its group has it. Throws InputError, here or from next(), where the file has
/// changed, its filters are not in this libhdf5, or its bytes cannot be what its shape says.
std::unique_ptr<Hdf5Rows> hdf5Rows(const std::string& path, const std::string& group, const Hdf5Array& array);

}  // namespace mote
