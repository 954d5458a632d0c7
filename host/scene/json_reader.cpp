#include "host/scene/json_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "host/core/error.h"

namespace mote {
namespace {

using Kind = JsonNode::Kind;

/// "a, b or c", each in quotes.
std::string wordList(std::span<const std::string_view> words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += fmt::format("{}\"{}\"", i == 0 ? "" : i + 1 == words.size() ? " or " : ", ", words[i]);
  return text;
}

/// A JSON number as a 64-bit integer, or nothing. Signed ones as two's complement.
std::optional<std::uint64_t> exactInteger(const JsonNode& node, bool isSigned) {
  const char* begin = node.text.data();
  const char* end = begin + node.text.size();
  const auto whole = [&](auto value) -> std::optional<std::uint64_t> {
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error != std::errc{} || stop != end) return std::nullopt;
    return static_cast<std::uint64_t>(value);
  };
  if (const auto value = isSigned ? whole(std::int64_t{}) : whole(std::uint64_t{})) return value;
  // 1e6 and -0: whole all the same. Above 2^53 a double cannot say which integer was meant.
  if (std::trunc(node.number) != node.number || std::abs(node.number) > 0x1p53) return std::nullopt;
  if (!isSigned && node.number < 0) return std::nullopt;
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(node.number));
}

std::size_t editDistance(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  // Rows of the alignment table of prefixes (optimal string alignment): the last three are enough.
  std::vector<std::size_t> before(b.size() + 1), previous(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(previous);
    previous.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string rangeText(std::string_view what, const Range& range) {
  std::string text(what);
  const bool low = std::isfinite(range.min), high = std::isfinite(range.max);
  if (low && high && !range.minOpen && !range.maxOpen) {
    text += fmt::format(" from {} to {}", range.min, range.max);
  } else {
    if (low) text += fmt::format(" {} {}", range.minOpen ? ">" : ">=", range.min);
    if (high) text += fmt::format("{} {} {}", low ? " and" : "", range.maxOpen ? "<" : "<=", range.max);
  }
  if (!range.unit.empty()) text += fmt::format(" [{}]", range.unit);
  return text;
}

bool isInside(double value, const Range& range) {
  return (range.minOpen ? value > range.min : value >= range.min) &&
         (range.maxOpen ? value < range.max : value <= range.max);
}

std::string_view nearestWord(std::string_view word, std::span<const std::string_view> words) {
  constexpr std::size_t kLongEnough = 64;  // no key is longer; bounds the work for a hostile file
  std::string_view nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const std::string_view candidate : words) {
    const std::size_t distance = editDistance(word.substr(0, kLongEnough), candidate);
    if (distance < least) least = distance, nearest = candidate;
  }
  return nearest;
}

void JsonReading::throwFirst() const {
  const std::string& first = unknownKey_.empty() ? firstProblem_ : unknownKey_;
  if (!first.empty()) throw InputError(first);
}

ObjectReader::ObjectReader(JsonReading& reading, std::string_view noun)
    : ObjectReader(reading, &reading.document_.root(), "", "", noun) {
  if (node_->kind == Kind::Object) return;
  problemAt(node_->place, "", "a JSON object", node_->shown(),
            R"(a scene needs at least {"particles":[{"file":"x.prt"}]})");
  node_ = nullptr;
}

ObjectReader::ObjectReader(JsonReading& reading, const JsonNode* node, std::string pointer, std::string generic,
                           std::string_view noun)
    : reading_(&reading), node_(node), pointer_(std::move(pointer)), generic_(std::move(generic)), noun_(noun) {
  reading_->keys_[generic_];
}

const JsonNode* ObjectReader::find(std::string_view key) {
  std::vector<std::string>& asked = reading_->keys_[generic_];
  if (std::find(asked.begin(), asked.end(), key) == asked.end()) asked.emplace_back(key);
  const JsonMember* member = node_ ? node_->find(key) : nullptr;
  return member ? &member->value : nullptr;
}

bool ObjectReader::number(std::string_view key, float& value, Range range) {
  const JsonNode* node = find(key);
  return node && numberAt(childPointer(pointer_, key), *node, value, range);
}

bool ObjectReader::numberAt(const std::string& pointer, const JsonNode& node, float& value, const Range& range) {
  const auto rounded = static_cast<float>(node.number);
  Range roundedRange = range;
  roundedRange.min = static_cast<double>(static_cast<float>(range.min));
  roundedRange.max = static_cast<double>(static_cast<float>(range.max));
  // A number may leave an open range by rounding: 1e-60 becomes 0, 179.999999999 becomes 180. And 1e60 is no float.
  const bool good = node.kind == Kind::Number && std::isfinite(rounded) && isInside(node.number, range) &&
                    isInside(static_cast<double>(rounded), roundedRange);
  if (good) {
    value = rounded;
  } else {
    const bool tooLarge = node.kind == Kind::Number && !std::isfinite(rounded) && isInside(node.number, range);
    const bool rounds = node.kind == Kind::Number && std::isfinite(rounded) && isInside(node.number, range);
    problemAt(node.place, pointer, rangeText("a number", range), node.shown(),
              tooLarge ? "numbers are single precision, up to 3.4e38"
              : rounds ? fmt::format("numbers are single precision: this one is {}", rounded)
                       : "");
  }
  return good;
}

bool ObjectReader::numberAt(const std::string& pointer, const JsonNode& node, double& value, const Range& range) {
  const bool good = node.kind == Kind::Number && std::isfinite(node.number) && isInside(node.number, range);
  if (good) {
    value = node.number;
  } else {
    problemAt(node.place, pointer, rangeText("a number", range), node.shown());
  }
  return good;
}

std::optional<std::uint64_t> ObjectReader::wholeNumber(std::string_view key, const JsonNode& node, std::uint64_t min,
                                                       std::uint64_t max, bool isSigned, std::string_view unit) {
  return wholeNumberAt(childPointer(pointer_, key), node, min, max, isSigned, unit);
}

std::optional<std::uint64_t> ObjectReader::wholeNumberAt(const std::string& pointer, const JsonNode& node,
                                                         std::uint64_t min, std::uint64_t max, bool isSigned,
                                                         std::string_view unit) {
  const auto signedOf = [](std::uint64_t bits) { return static_cast<std::int64_t>(bits); };
  const auto read = node.kind == Kind::Number ? exactInteger(node, isSigned) : std::nullopt;
  const bool good = read && (isSigned ? signedOf(*read) >= signedOf(min) && signedOf(*read) <= signedOf(max)
                                      : *read >= min && *read <= max);
  if (good) return read;
  std::string expected = isSigned ? fmt::format("a whole number from {} to {}", signedOf(min), signedOf(max))
                                  : fmt::format("a whole number from {} to {}", min, max);
  if (!unit.empty()) expected += fmt::format(" [{}]", unit);
  problemAt(node.place, pointer, expected, node.shown());
  return std::nullopt;
}

bool ObjectReader::boolean(std::string_view key, bool& value) {
  const JsonNode* node = find(key);
  if (!node) return false;
  if (node->kind == Kind::Boolean) return value = node->boolean, true;
  problem(key, "true or false", node->shown());
  return false;
}

bool ObjectReader::text(std::string_view key, std::string& value) {
  const JsonNode* node = find(key);
  if (!node) return false;
  const bool good = node->kind == Kind::String && !node->text.empty() &&
                    std::none_of(node->text.begin(), node->text.end(),
                                 [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (good) return value = node->text, true;
  problem(key, "text that is not empty and without control characters", node->shown());
  return false;
}

template <class Vector>
bool ObjectReader::vectorAt(std::string_view key, Vector& value, const Range& range) {
  const JsonNode* node = find(key);
  if (!node) return false;
  const std::string at = childPointer(pointer_, key);
  constexpr int kLength = Vector::length();
  if (node->kind != Kind::Array || node->items.size() != kLength)
    return problemAt(node->place, at, fmt::format("an array of {} numbers", kLength), node->shown()), false;
  Vector read = value;
  bool good = true;
  for (int i = 0; i < kLength; ++i)
    good &= numberAt(fmt::format("{}/{}", at, i), node->items[static_cast<std::size_t>(i)], read[i], range);
  if (good) value = read;
  return good;
}

bool ObjectReader::vector(std::string_view key, vec3& value, Range range) { return vectorAt(key, value, range); }
bool ObjectReader::vector(std::string_view key, dvec3& value, Range range) { return vectorAt(key, value, range); }
bool ObjectReader::vector(std::string_view key, vec2& value, Range range) { return vectorAt(key, value, range); }

bool ObjectReader::pair(std::string_view key, ivec2& value, int min, int max, std::string_view unit) {
  const JsonNode* node = find(key);
  if (!node) return false;
  const std::string at = childPointer(pointer_, key);
  if (node->kind != Kind::Array || node->items.size() != 2)
    return problemAt(node->place, at, "an array of 2 whole numbers", node->shown()), false;
  const auto read = [&](std::size_t i) {
    return wholeNumberAt(fmt::format("{}/{}", at, i), node->items[i], static_cast<std::uint64_t>(min),
                         static_cast<std::uint64_t>(max), true, unit);
  };
  const auto x = read(0), y = read(1);
  if (x && y) value = {static_cast<int>(*x), static_cast<int>(*y)};
  return x && y;
}

std::optional<std::size_t> ObjectReader::word(const std::string& pointer, const JsonNode& node,
                                              std::span<const std::string_view> words) {
  const bool isText = node.kind == Kind::String;
  const auto found = isText ? std::find(words.begin(), words.end(), node.text) : words.end();
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  const std::string hint =
      isText && words.size() > 1 ? fmt::format("the nearest is \"{}\"", nearestWord(node.text, words)) : "";
  problemAt(node.place, pointer, wordList(words), node.shown(), hint);
  return std::nullopt;
}

bool ObjectReader::words(std::string_view key, std::vector<bool>& set, std::span<const std::string_view> allowed) {
  const JsonNode* node = find(key);
  if (!node) return false;
  if (node->kind != Kind::Array) return problem(key, "an array of words", node->shown()), false;
  for (std::size_t i = 0; i < node->items.size(); ++i) {
    const std::string at = fmt::format("{}/{}", childPointer(pointer_, key), i);
    const auto index = word(at, node->items[i], allowed);
    if (index && set[*index]) problemAt(node->items[i].place, at, "each word once", node->items[i].shown());
    if (index) set[*index] = true;
  }
  return true;
}

ObjectReader ObjectReader::object(std::string_view key, std::string_view noun) {
  const JsonNode* node = find(key);
  if (node && node->kind != Kind::Object) problem(key, "an object", node->shown());
  return objectIfAny(key, noun);
}

ObjectReader ObjectReader::objectIfAny(std::string_view key, std::string_view noun) {
  const JsonNode* node = find(key);
  const bool isObject = node && node->kind == Kind::Object;
  return {*reading_, isObject ? node : nullptr, childPointer(pointer_, key), childPointer(generic_, key), noun};
}

std::vector<ObjectReader> ObjectReader::list(std::string_view key, std::string_view noun) {
  std::vector<ObjectReader> objects;
  const JsonNode* node = find(key);
  if (!node) return objects;
  if (node->kind != Kind::Array) return problem(key, "an array of objects", node->shown()), objects;
  const std::string at = childPointer(pointer_, key), generic = childPointer(generic_, key) + "/*";
  for (std::size_t i = 0; i < node->items.size(); ++i) {
    const JsonNode& item = node->items[i];
    std::string itemPointer = fmt::format("{}/{}", at, i);
    if (item.kind != Kind::Object) problemAt(item.place, itemPointer, "an object", item.shown());
    const JsonNode* itemNode = item.kind == Kind::Object ? &item : nullptr;
    objects.push_back(ObjectReader(*reading_, itemNode, std::move(itemPointer), generic, noun));
  }
  return objects;
}

void ObjectReader::onlyWhere(bool applies, std::string_view key, std::string_view expected, std::string_view hint) {
  if (!applies && has(key)) problem(key, expected, fmt::format("\"{}\" here", key), hint);
}

void ObjectReader::problem(std::string_view key, std::string_view expected, std::string_view got,
                           std::string_view hint) {
  const JsonMember* member = node_ && !key.empty() ? node_->find(key) : nullptr;
  const JsonPlace place = member ? member->value.place : node_ ? node_->place : JsonPlace{};
  problemAt(place, member ? childPointer(pointer_, key) : pointer_, expected, got, hint);
}

void ObjectReader::problemAt(JsonPlace place, std::string_view pointer, std::string_view expected, std::string_view got,
                             std::string_view hint) {
  if (!reading_->firstProblem_.empty()) return;
  reading_->firstProblem_ = InputError(reading_->document_.where(place), pointer, expected, got, hint).what();
}

void ObjectReader::finish() {
  if (!node_) return;
  const std::vector<std::string>& asked = reading_->keys_[generic_];
  const std::vector<std::string_view> known(asked.begin(), asked.end());
  for (const JsonMember& member : node_->members) {
    if (std::find(known.begin(), known.end(), member.key) != known.end()) continue;
    const std::string expected = fmt::format("a key of {}, {}", noun_, wordList(known));
    const std::string place = reading_->document_.where(member.place), at = childPointer(pointer_, member.key);
    if (!reading_->unknownKey_.empty()) continue;
    reading_->unknownKey_ =
        InputError(place, at, expected, fmt::format("the unknown key {}", quotedForMessage(member.key)),
                   fmt::format("the nearest is \"{}\"", nearestWord(member.key, known)))
            .what();
  }
}

}  // namespace mote
