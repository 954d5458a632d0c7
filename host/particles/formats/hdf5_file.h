// An HDF5 file as particles need it: groups, arrays of numbers of one or two dimensions, short attributes. The only
// file of ours that knows libhdf5 is hdf5_file.cpp.
//
// libhdf5 prints nothing here, follows no link into other files, and reads numbers from no other file. What its headers
// say is checked against the bytes that are there before anything is allocated by it; deflate is undone here, as
// libhdf5 would let it grow without an end.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
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
};

/// Whether libhdf5 is in this build (CMake option MOTE_HDF5). Without it Hdf5File's constructor throws InputError.
bool hasHdf5();

/// Goes through the rows of an array once, in order.
class Hdf5Rows {
 public:
  virtual ~Hdf5Rows() = default;
  /// Puts the next rows, arity numbers each, little-endian, in place of what `rows` holds, and says how many they are;
  /// 0 at the end. At most some MiB, or one chunk of the file. Throws InputError where they are damaged.
  virtual std::size_t next(std::vector<std::byte>& rows) = 0;
};

class Hdf5File {
 public:
  /// Throws InputError where it is none, is cut off or damaged, in libhdf5's words.
  explicit Hdf5File(const std::string& path);
  ~Hdf5File();
  Hdf5File(Hdf5File&&) noexcept;

  /// Names of the groups in the file's root.
  std::vector<std::string> groups() const;
  /// The arrays in a group of the root, "" being the root, by name; others are left out. Empty where there is no such
  /// group.
  std::vector<Hdf5Array> arrays(const std::string& group) const;
  /// Attributes of a group: up to 64 numbers each, or a text. Empty where there is no such group.
  std::vector<Metadata> attributes(const std::string& group) const;
  /// The file must outlive the result. Throws InputError where its filters are not in this libhdf5, or its bytes cannot
  /// be what its shape says.
  std::unique_ptr<Hdf5Rows> rows(const std::string& group, const Hdf5Array& array) const;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace mote
