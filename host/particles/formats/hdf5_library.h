// What we ask libhdf5 for; no other file of ours knows it. Hdf5File is what readers use: it calls this in a process of
// its own, as damaged files make libhdf5 read and write memory that is not its own.
//
// It prints nothing, follows no link into other files, and reads numbers from no other file. What its headers say is
// checked against the bytes that are there before anything is allocated by it; deflate is undone here, as libhdf5 would
// let it grow without an end.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/hdf5_file.h"

namespace mote {

class Hdf5Library {
 public:
  /// Throws InputError where it is none, is cut off or damaged, in libhdf5's words.
  explicit Hdf5Library(const std::string& path);
  ~Hdf5Library();

  /// The root and its groups. Throws InputError.
  std::vector<Hdf5Group> groups() const;
  /// Hands over all rows of an array in order, some MiB at once, or one chunk of the file. Throws InputError where its
  /// filters are not in this libhdf5, or its bytes cannot be what its shape says.
  void rows(const std::string& group, const Hdf5Array& array,
            const std::function<void(std::span<const std::byte>)>& take) const;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace mote
