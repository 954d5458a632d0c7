// NumPy's arrays put together byte by byte, for tests of readers.
#pragma once
#include <string>

namespace mote::test {

/// A header with its dictionary, and the data behind it.
inline std::string npy(const std::string& dictionary, const std::string& data, int major = 1) {
  const std::string header = dictionary + "\n";
  std::string out = std::string("\x93NUMPY", 6) + static_cast<char>(major) + '\0';
  for (int k = 0; k < (major == 1 ? 2 : 4); ++k) out += static_cast<char>(header.size() >> (8 * k) & 0xff);
  return out + header + data;
}

inline std::string dictionary(const std::string& descr, const std::string& shape,
                              const std::string& fortran = "False") {
  return "{'descr': " + descr + ", 'fortran_order': " + fortran + ", 'shape': " + shape + ", }";
}

}  // namespace mote::test
