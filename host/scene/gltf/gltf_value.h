// A place in a glTF's JSON: typed, checked access, with the file and the pointer of what is wrong in every message.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "host/core/vec.h"
#include "host/scene/json_reader.h"

namespace mote {

/// A value, or the absence of one. Cheap to pass on, but each step builds its pointer. Every getter throws InputError
/// "shot.glb: /nodes/3/rotation: expected …, got …" where something else stands there.
class GltfValue {
 public:
  /// `file` and the tree below `node` must outlive it.
  GltfValue(const std::string& file, const JsonNode* node, std::string pointer = {})
      : file_(&file), node_(node), pointer_(std::move(pointer)) {}

  explicit operator bool() const { return node_ != nullptr; }
  const std::string& pointer() const { return pointer_; }

  /// The member of an object; absent where it is not there, or where this is absent itself.
  GltfValue member(std::string_view key) const;
  /// Length of an array; 0 where absent.
  std::size_t size() const;
  /// i < size()
  GltfValue item(std::size_t i) const;

  /// A number in the range; `fallback` where absent.
  double number(double fallback, const Range& range) const;
  /// The same of one that must be there.
  double number(const Range& range) const;
  bool boolean(bool fallback) const;
  /// "" where absent.
  std::string text() const;
  /// A whole number from 0 to `count` − 1, an index of `nouns`. Must be there.
  std::size_t index(std::size_t count, std::string_view nouns) const;
  /// A whole number from 0 to 2^53, the largest that JSON's readers agree on; `fallback` where absent.
  std::uint64_t size64(std::uint64_t fallback) const;
  /// `count` finite numbers into `values`, which stay where absent. Returns whether it was there.
  bool numbers(double* values, std::size_t count) const;

  [[noreturn]] void refuse(std::string_view expected, std::string_view got, std::string_view hint = {}) const;

 private:
  const std::string* file_;
  const JsonNode* node_;
  std::string pointer_;
};

}  // namespace mote
