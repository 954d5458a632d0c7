// A glTF 2.0 file, .gltf or .glb: its JSON, and numbers out of its buffers.
//
// Source: glTF 2.0 Specification (Khronos Group, 2021), §3.6 "Binary Data Storage" and §4 "GLB File Format".
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host/scene/gltf/gltf_value.h"
#include "host/scene/json_tree.h"

namespace mote {

class GltfFile {
 public:
  /// Opens the file by its content, whatever its name. Reads the JSON only: a GLB's binary chunk stays on the disk.
  /// Throws InputError: no such file (with the nearest names), no glTF, another version, cut short, broken JSON (with
  /// line and column of it), more than 64 MiB of JSON.
  explicit GltfFile(const std::string& path);

  const std::string& path() const { return path_; }
  GltfValue root() const { return {path_, &document_.root()}; }
  GltfValue list(std::string_view key) const { return root().member(key); }

  /// An accessor's elements of `width` numbers each (1: SCALAR, 3: VEC3, 4: VEC4), one after another. Normalised
  /// integers become −1…1 or 0…1. All numbers are finite. What is declared is held against the bytes that are there
  /// before anything is allocated. Throws InputError for what is out of bounds, of another type, or sparse.
  std::vector<float> numbers(std::size_t accessor, std::size_t width) const;

  /// The files beside this one that its buffers are in, as they are opened.
  std::vector<std::string> bufferFiles() const;

 private:
  struct Text {
    std::string json;
    std::uint64_t binary = 0, binaryBytes = 0;  // where a GLB's binary chunk is; 0 bytes: there is none
  };
  static Text readText(const std::string& path);
  GltfFile(const std::string& path, Text text);

  std::string bytes(std::size_t buffer, std::uint64_t offset, std::uint64_t count) const;

  std::string path_;
  JsonDocument document_;
  std::uint64_t binary_, binaryBytes_;
  mutable std::map<std::size_t, std::string> decoded_;  // buffers written as base64, by their number
};

}  // namespace mote
