// glTF files as bytes, for tests that write their own.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "host/core/vec.h"

namespace mote::test {

/// Numbers as little-endian bytes, one after another.
template <class T>
std::string bytesOf(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// A GLB file of a JSON text and a binary chunk.
inline std::string glb(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto word = [](std::size_t value) { return bytesOf(std::vector{static_cast<std::uint32_t>(value)}); };
  return "glTF" + word(2) + word(12 + 8 + json.size() + 8 + binary.size()) + word(json.size()) + "JSON" + json +
         word(binary.size()) + std::string("BIN\0", 4) + binary;
}

/// The cube [−1, 1]³ as 96 bytes of corners and 72 of 16-bit indices; kBoxMesh names them.
inline std::string boxBytes() {
  std::vector<float> corners;
  for (const float x : {-1.0f, 1.0f})
    for (const float y : {-1.0f, 1.0f})
      for (const float z : {-1.0f, 1.0f}) corners.insert(corners.end(), {x, y, z});
  std::vector<std::uint16_t> indices;
  for (const auto& [a, b, c, d] : std::initializer_list<std::array<std::uint16_t, 4>>{
           {0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}})
    indices.insert(indices.end(), {a, b, c, a, c, d});
  return bytesOf(corners) + bytesOf(indices);
}

/// Members of a glTF whose mesh 0 is that box, in bytes 0 to 167 of buffer 0; BYTES is the buffer's length. More
/// buffer views and accessors may follow: they are numbers 2 and up.
inline std::string boxMesh(std::size_t bytes, const std::string& buffer = "", const std::string& views = "",
                           const std::string& accessors = "") {
  return R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":)" +
         std::to_string(bytes) + buffer +
         R"(}],"bufferViews":[{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":72})" + views +
         R"(],"accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[-1,-1,-1],)" +
         R"("max":[1,1,1]},{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"})" + accessors + "]";
}

/// A glTF of these members besides "asset".
inline std::string gltf(const std::string& members) { return R"({"asset":{"version":"2.0"},)" + members + "}"; }

inline std::string base64(const std::string& bytes) {
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kLetters[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

}  // namespace mote::test
