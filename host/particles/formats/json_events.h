// JSON as a stream of events, of a text or of Houdini's binary encoding: nothing of a file is kept but what its reader
// keeps.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "host/particles/formats/number_type.h"
#include "host/particles/formats/unpacked_file.h"

namespace mote {

/// Told what stands in a file, in its order.
class JsonEvents {
 public:
  virtual ~JsonEvents() = default;
  /// `begin`: the place of its first byte. False: the array is stepped over, and its end is not told.
  virtual bool beginArray(std::uint64_t begin) = 0;
  virtual void endArray() = 0;
  /// As beginArray.
  virtual bool beginMap() = 0;
  virtual void endMap() = 0;
  virtual void key(const std::string& name) = 0;
  virtual void text(const std::string& value) = 0;
  virtual void integer(std::int64_t value) = 0;
  virtual void real(double value) = 0;
  virtual void boolean(bool value) = 0;
  virtual void null() = 0;
  /// A run of an array whose numbers are of one type, little-endian, not aligned (binary alone).
  virtual void numbers(NumberType type, const std::byte* from, std::size_t count) = 0;
};

/// Reads the value that begins at the file's position, to its end. Throws InputError on any breach of JSON, with the
/// byte and what stands there. Cost: about 50 MB/s of numbers, and what is stepped over 600 MB/s, without being
/// checked.
void readTextJson(UnpackedFile& file, JsonEvents& events);

/// The same of Houdini's binary JSON, without the magic number in front (its makers' UT_JSON, as public readers have
/// it): tokens of one byte, texts that are defined once and referred to, and arrays of one type. Little-endian. Cost:
/// of arrays of one type that of the bytes.
void readBinaryJson(UnpackedFile& file, JsonEvents& events);

}  // namespace mote
