// A file in Houdini's seekable compressed format (.bgeo.sc, "scf1"), read as what was packed.
//
// Big-endian: "scf1", the length of metadata [uint64] and those, then blocks that Blosc packed, one after another, each
// with Blosc's own header; behind them the index, its length [uint64] and "1fcs". The blocks' own headers say where
// they are, so that the index is stepped over. (Public readers and writers of these files agree on that; its makers
// publish no description.)
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/input_file.h"

namespace mote {

class ScfFile {
 public:
  /// Reads the blocks' headers. Throws InputError where they do not fill the file, where a block is larger than 16 MiB,
  /// and where all of them are larger than deflate could make them.
  explicit ScfFile(std::string path);

  const std::string& path() const { return file_.path(); }
  std::uint64_t bytes() const { return file_.bytes(); }  ///< of the file as it is

  void seek(std::uint64_t position) { at_ = position; }
  /// As many as there are: fewer than `wanted` only at the end. Throws InputError where the packed data are damaged.
  std::size_t read(std::byte* to, std::size_t wanted);

 private:
  struct Block {
    std::uint64_t place = 0;  ///< in the file
    std::uint64_t begin = 0;  ///< in what was packed
    std::uint32_t packed = 0, bytes = 0;
  };
  void unpack(std::size_t block);
  [[noreturn]] void fail(std::uint64_t place, const std::string& expected, const std::string& got) const;

  InputFile file_;
  std::vector<Block> blocks_;
  std::uint64_t at_ = 0;
  std::size_t current_ = static_cast<std::size_t>(-1);  ///< the block that data_ is
  std::vector<std::byte> data_, packed_;
};

bool beginsAsScf(std::span<const std::byte> start);

}  // namespace mote
