// Reads PRT 1.0 and 1.1 files: the header checked whole, then any channels converted in one pass over the zlib stream.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "host/core/vec.h"
#include "host/particles/prt_format.h"

namespace mote {

/// A channel to read and where to put it: the vector is cleared, then gets one entry a particle.
///   float, uint64   a channel of arity 1
///   vec3            arity 3 or more (the first three numbers), or 1 (the number three times)
///   std::byte       any: the raw numbers, bytes() a particle
/// Numbers are converted as numbers (uint8 255 becomes 255.0f); for uint64, signed integers keep their bits and
/// floats are cut to integers, 0 where they are negative or not numbers.
struct PrtRequest {
  std::string channel;
  std::variant<std::vector<float>*, std::vector<vec3>*, std::vector<std::uint64_t>*, std::vector<std::byte>*> target;
};

class PrtReader {
 public:
  /// Opens the file and checks everything in front of the particles. Throws InputError naming file, field and value.
  /// Also refused: a count whose particles could not possibly come out of the bytes that follow (zlib expands at most
  /// 1032 times), so that nothing is ever allocated on the header's word alone.
  explicit PrtReader(std::string path);

  const std::string& path() const { return path_; }
  const PrtHeader& header() const { return header_; }
  std::uint64_t count() const { return header_.count; }

  /// Decompresses the particles, all of them, and fills the requested vectors; may be called again.
  /// Throws InputError where the file lacks a channel, its arity does not fit, the data are truncated ("particle K of
  /// N"), or zlib finds them corrupt; MachineError where memory runs out. The targets are then unspecified.
  /// Data behind the last particle are a warning. Cost: that of zlib, about 0.3 GB/s of particles.
  void read(std::span<const PrtRequest> requests) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  PrtHeader header_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t dataBegin_ = 0, fileBytes_ = 0;
};

}  // namespace mote
