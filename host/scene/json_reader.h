// Typed, checked access to the objects of a JSON document; a key that nobody asked for is an error.
//
// Problems are collected and the first is thrown at the end by JsonReading::throwFirst. Unknown keys go first, because
// a misspelt key also looks like a missing one.
#pragma once
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "host/core/vec.h"
#include "host/scene/json_tree.h"

namespace mote {

/// Numbers a key takes, with the unit for messages.
struct Range {
  double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
  bool minOpen = false, maxOpen = false;  ///< open: the bound itself is out
  std::string_view unit = {};
};
constexpr Range atLeast(double min, std::string_view unit = {}) { return {.min = min, .unit = unit}; }
constexpr Range above(double min, std::string_view unit = {}) { return {.min = min, .minOpen = true, .unit = unit}; }
constexpr Range between(double min, double max, std::string_view unit = {}) {
  return {.min = min, .max = max, .unit = unit};
}

bool isInside(double value, const Range& range);
/// "a number > 0 and <= 1 [unit]", where `what` is "a number".
std::string rangeText(std::string_view what, const Range& range);

/// A word of the file and what it stands for.
template <class E>
struct Choice {
  std::string_view word;
  E value;
};

/// What one reading of a document has in common.
class JsonReading {
 public:
  explicit JsonReading(const JsonDocument& document) : document_(document) {}

  /// Throws the most telling problem, if there is one, as InputError.
  void throwFirst() const;
  /// Every key asked for, by object: its pointer with * for array indices, "/lights/*".
  const std::map<std::string, std::vector<std::string>>& keysAskedFor() const { return keys_; }

 private:
  friend class ObjectReader;
  const JsonDocument& document_;
  std::string unknownKey_, firstProblem_;
  std::map<std::string, std::vector<std::string>> keys_;
};

/// One object. Every getter leaves `value` as it was, its default, where the key is absent or (with a problem noted)
/// wrong. An absent object reads as an empty one.
class ObjectReader {
 public:
  /// The root object of a document; `noun` is what messages call it: "the scene".
  ObjectReader(JsonReading& reading, std::string_view noun);

  bool has(std::string_view key) const { return node_ && node_->find(key); }
  /// The value of a key that takes several types, or null; it counts as asked for.
  const JsonNode* find(std::string_view key);

  /// `value` is a float and lies in the range both as written and as rounded. Returns true if it was set.
  bool number(std::string_view key, float& value, Range range);
  /// Whole numbers min … max; 1e6 and 2.0 count as whole.
  template <class Int>
  bool integer(std::string_view key, Int& value, Int min, Int max, std::string_view unit = {}) {
    const JsonNode* node = find(key);
    const auto read = node ? wholeNumber(key, *node, min, max, std::is_signed_v<Int>, unit) : std::nullopt;
    if (read) value = static_cast<Int>(*read);
    return read.has_value();
  }
  bool boolean(std::string_view key, bool& value);
  /// Not empty and without control characters.
  bool text(std::string_view key, std::string& value);
  /// [x, y, z], each in the range.
  bool vector(std::string_view key, vec3& value, Range range);
  bool vector(std::string_view key, dvec3& value, Range range);
  /// [x, y], each in the range.
  bool vector(std::string_view key, vec2& value, Range range);
  /// [x, y] of whole numbers, each in min … max.
  bool pair(std::string_view key, ivec2& value, int min, int max, std::string_view unit);
  /// One of the words.
  template <class E>
  bool choice(std::string_view key, E& value, std::initializer_list<Choice<E>> choices) {
    std::vector<std::string_view> words;
    for (const Choice<E>& choice : choices) words.push_back(choice.word);
    const JsonNode* node = find(key);
    const auto index = node ? word(childPointer(pointer_, key), *node, words) : std::nullopt;
    if (index) value = choices.begin()[*index].value;
    return index.has_value();
  }
  /// An array of different words; `set[i]` becomes true where words[i] stands in it.
  bool words(std::string_view key, std::vector<bool>& set, std::span<const std::string_view> words);

  /// The object at `key`; where something else stands there, that is a problem.
  ObjectReader object(std::string_view key, std::string_view noun);
  /// The same without the problem: for keys that may hold an object or something else.
  ObjectReader objectIfAny(std::string_view key, std::string_view noun);
  /// The objects of the array at `key`, each called `noun`.
  std::vector<ObjectReader> list(std::string_view key, std::string_view noun);

  /// Notes a problem where `key` is present but `applies` is false: "expected this key only in …".
  void onlyWhere(bool applies, std::string_view key, std::string_view expected, std::string_view hint = {});
  /// Notes a problem at the key, or at this object where the key is absent.
  void problem(std::string_view key, std::string_view expected, std::string_view got, std::string_view hint = {});
  /// Notes a problem for each key that nobody asked for. To be called last.
  void finish();

  /// Something is wrong in the document so far.
  bool hasProblems() const { return !reading_->unknownKey_.empty() || !reading_->firstProblem_.empty(); }

  const std::string& pointer() const { return pointer_; }

 private:
  ObjectReader(JsonReading& reading, const JsonNode* node, std::string pointer, std::string generic,
               std::string_view noun);
  void problemAt(JsonPlace place, std::string_view pointer, std::string_view expected, std::string_view got,
                 std::string_view hint = {});
  bool numberAt(const std::string& pointer, const JsonNode& node, float& value, const Range& range);
  bool numberAt(const std::string& pointer, const JsonNode& node, double& value, const Range& range);
  template <class Vector>
  bool vectorAt(std::string_view key, Vector& value, const Range& range);
  /// The integer as its two's complement bits; min and max converted to 64 bits by the caller's type.
  std::optional<std::uint64_t> wholeNumber(std::string_view key, const JsonNode& node, std::uint64_t min,
                                           std::uint64_t max, bool isSigned, std::string_view unit);
  std::optional<std::uint64_t> wholeNumberAt(const std::string& pointer, const JsonNode& node, std::uint64_t min,
                                             std::uint64_t max, bool isSigned, std::string_view unit);
  std::optional<std::size_t> word(const std::string& pointer, const JsonNode& node,
                                  std::span<const std::string_view> words);

  JsonReading* reading_;
  const JsonNode* node_;  // null: absent, or no object
  std::string pointer_, generic_;
  std::string_view noun_;
};

/// The word of fewest edits (insert, delete, replace, swap neighbours; letter case is free) from `word`; "" of none.
std::string_view nearestWord(std::string_view word, std::span<const std::string_view> words);

}  // namespace mote
