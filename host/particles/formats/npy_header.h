// An array in NumPy's format, version 1.0 to 3.0: its header, and its rows as a table of particles (NumPy Enhancement
// Proposal 1, "A Simple File Format for NumPy Arrays"). For readers of NPY and of NPZ, which holds many of them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/particles/formats/component_names.h"

namespace mote {

constexpr char kNpyMagic[] = {'\x93', 'N', 'U', 'M', 'P', 'Y'};
/// Bytes of a particle that any reader of NumPy's arrays takes at most.
constexpr std::uint64_t kMostNpyRow = 1 << 20;

/// What a header says.
struct NpyArray {
  std::string version;                ///< "1.0"
  std::vector<std::uint64_t> shape;   ///< of no numbers: a scalar
  std::vector<PlacedChannel> fields;  ///< numbers of one element; one without a name where the array has no fields
  std::size_t elementBytes = 0;
  std::string notNumbers;       ///< the first type that stands for no numbers: "|O", "<U5"; empty: there is none
  std::string notNumbersField;  ///< of that field; empty: of the whole array
  bool structured = false;      ///< an array with fields
  bool fortranOrder = false;    ///< the first index runs fastest
  bool bigEndian = false;       ///< all numbers of more than one byte
  std::uint64_t dataBegin = 0;  ///< bytes of the header with everything in front of it
};

/// Gives the next `count` bytes, or throws InputError, which says `what` was to be read.
using NpyBytes = std::function<std::string(std::uint64_t count, std::string_view what)>;
/// Reads a header. `place` begins every message; `size` is what the bytes are in all. Throws InputError on any breach
/// of the format, and where fields differ in byte order.
NpyArray readNpyHeader(const std::string& place, const NpyBytes& bytes, std::uint64_t size);
/// Throws InputError where an array holds objects, text, complex numbers or dates.
void requireNumbers(const std::string& place, const NpyArray& array);

/// An array as rows, one a particle.
struct NpyTable {
  std::uint64_t count = 0;
  std::size_t rowBytes = 0;             ///< ≥ 1
  std::vector<PlacedChannel> channels;  ///< their places in a row
  bool bigEndian = false;
  bool byColumns = false;  ///< Fortran's order: all first numbers, then all second ones …
};
/// The table that a whole file is: fields by their names (vectors joined as component_names.h says), or the columns of
/// an array without fields, which are a position and more. Throws InputError where it is no table of particles.
NpyTable npyTable(const std::string& place, const NpyArray& array);
/// The numbers of a row of an array without fields: the product of its shape's rest.
std::uint64_t numbersOfRow(const std::string& place, const NpyArray& array);

/// Fills `bytes` bytes from a place in the array's data.
using NpyFill = std::function<void(std::byte* to, std::uint64_t from, std::size_t bytes)>;

/// Reads rows of a table in blocks, from first to last; of a table that is not by columns `fill` is asked for one byte
/// after another.
class NpyRows {
 public:
  /// Blocks are as long as suits `longestRow`, where several tables are read side by side; else as suits this one.
  NpyRows(const NpyTable& table, NpyFill fill, std::size_t longestRow = 0);

  std::size_t perBlock() const { return perBlock_; }
  /// `count` ≤ perBlock() rows, which stand until the next call.
  std::byte* read(std::uint64_t first, std::size_t count);

 private:
  const NpyTable& table_;
  NpyFill fill_;
  std::size_t perBlock_;
  std::vector<std::byte> rows_, column_;
};

}  // namespace mote
