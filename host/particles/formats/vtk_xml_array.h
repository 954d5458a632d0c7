// The numbers of a DataArray of a VTK XML file: text, base64 or raw bytes, packed or not ("VTK XML Formats", Kitware;
// the heads of binary data as vtkXMLDataParser reads them).
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/number_type.h"

namespace mote {

/// What a file says of all its arrays.
struct VtkXmlCoding {
  enum class Packing { None, Zlib, Lz4 };
  Packing packing = Packing::None;
  std::size_t headBytes = 4;  ///< of a length or size in front of binary data: 4 or 8 (`header_type`)
  bool bigEndian = false;
};

/// Where an array stands.
struct VtkXmlPlace {
  enum class Form { Text, Base64, Raw };
  Form form = Form::Text;
  std::uint64_t begin = 0, end = 0;  ///< bytes of the file; an appended array ends before `end`
};

/// Goes through the numbers once, in order. Others that read the file meanwhile disturb it.
class VtkXmlNumbers {
 public:
  virtual ~VtkXmlNumbers() = default;

  /// The next `count` numbers. Throws InputError where there are fewer, or what stands there are none.
  virtual void read(std::byte* to, std::size_t count) = 0;
  /// Whether read() gives big-endian numbers.
  virtual bool bigEndian() const = 0;
  /// What they take in the file, with the sizes in front of them.
  virtual std::uint64_t bytesInFile() const = 0;
};

/// Reads what stands in front of the numbers. Throws InputError (place: the file; field: `what`) where that does not
/// fit `count` numbers or asks for more than the file has. Nothing is allocated but for bytes that are there.
std::unique_ptr<VtkXmlNumbers> openVtkXmlNumbers(const InputFile& file, const VtkXmlCoding& coding,
                                                 const VtkXmlPlace& place, NumberType type, std::uint64_t count,
                                                 const std::string& what);

}  // namespace mote
