#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <unordered_map>
#include <vector>

#include "host/core/error.h"
#include "host/particles/formats/json_events.h"
#include "host/particles/formats/number_visit.h"

namespace mote {
namespace {

/// Tokens, as UT_JSON numbers them.
enum : int {
  kNull = 0x00,
  kBool = 0x10,  // and one byte
  kTextRef = 0x26,
  kText = 0x27,
  kTextDef = 0x2b,
  kTextUndef = 0x2d,
  kFalse = 0x30,
  kTrue = 0x31,
  kUniformArray = 0x40,
  kArray = '[',
  kArrayEnd = ']',
  kMap = '{',
  kMapEnd = '}',
};

constexpr std::size_t kMostDepth = 256;        ///< Houdini needs some twenty
constexpr std::uint64_t kMostText = 1 << 20;   ///< bytes of one text
constexpr std::uint64_t kMostTexts = 1 << 26;  ///< bytes of all texts that are defined
constexpr std::size_t kBlockBytes = 1 << 16;
constexpr std::uint64_t kTextCost = 64;  ///< what keeping a text takes beside its bytes

std::optional<NumberType> numberType(int token) {
  switch (token) {
    case 0x11: return NumberType::I8;
    case 0x12: return NumberType::I16;
    case 0x13: return NumberType::I32;
    case 0x14: return NumberType::I64;
    case 0x18: return NumberType::F16;
    case 0x19: return NumberType::F32;
    case 0x1a: return NumberType::F64;
    case 0x21: return NumberType::U8;
    case 0x22: return NumberType::U16;
    default: return std::nullopt;
  }
}

class BinaryJson {
 public:
  BinaryJson(UnpackedFile& file, JsonEvents& events) : file_(file), events_(events) {}

  /// One value with all that is in it.
  void value() {
    do {
      const int t = token();
      if (open_.empty() || open_.back() == kArray)
        t == kArrayEnd && !open_.empty() ? end() : begin(t);
      else
        t == kMapEnd ? end() : pair(t);
    } while (!open_.empty());
  }

 private:
  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    throw InputError(file_.path(), fmt::format("binary JSON, byte {}", file_.position()), expected, got,
                     "the file is damaged");
  }
  [[noreturn]] void failAtEnd() const {
    throw InputError(file_.path(), fmt::format("binary JSON, byte {}", file_.position()), "more bytes",
                     "the file's end", "the file is cut off");
  }

  int byte() {
    const int b = file_.next();
    if (b < 0) failAtEnd();
    return b;
  }
  std::uint64_t number(int size) {
    std::uint64_t value = 0;
    for (int k = 0; k < size; ++k) value |= static_cast<std::uint64_t>(byte()) << (8 * k);
    return value;
  }
  std::uint64_t length() {
    constexpr int kLongest = 0xf0;
    const int first = byte();
    if (first <= kLongest) return static_cast<std::uint64_t>(first);
    const int size = first - kLongest;
    if (size != 2 && size != 4 && size != 8) fail("a length", fmt::format("byte 0x{:02x}", first));
    return number(size);
  }
  /// The next one; it holds until the one behind it.
  const std::string& text() {
    const std::uint64_t size = length();
    if (size > kMostText) fail(fmt::format("a text of {} bytes at most", kMostText), fmt::format("{}", size));
    text_.resize(size);
    if (file_.read(reinterpret_cast<std::byte*>(text_.data()), size) != size) failAtEnd();
    return text_;
  }
  const std::string& definedText() {
    const std::uint64_t id = length();
    const auto found = texts_.find(id);
    if (found != texts_.end()) return found->second;
    fail("a text that was defined before", fmt::format("number {}", id));
  }
  void skip(std::uint64_t count, std::uint64_t size) {
    if (count > UINT64_MAX / size || !file_.skip(count * size)) failAtEnd();
  }

  /// The next token but definitions, which may stand anywhere.
  int token() {
    for (;;) {
      const int t = byte();
      if (t == kTextDef) {
        const std::uint64_t id = length();
        const std::string& value = text();
        textBytes_ += value.size() + kTextCost;
        if (textBytes_ > kMostTexts) fail(fmt::format("texts of {} bytes in all", kMostTexts), "more");
        texts_[id] = value;
      } else if (t == kTextUndef) {
        texts_.erase(length());
      } else {
        return t;
      }
    }
  }

  bool told() const { return skippedFrom_ == 0; }  ///< not within what is stepped over

  void open(int token, bool wanted) {
    if (open_.size() == kMostDepth) fail(fmt::format("arrays in arrays, {} deep at most", kMostDepth), "deeper ones");
    open_.push_back(static_cast<char>(token));
    if (told() && !wanted) skippedFrom_ = open_.size();
  }
  void end() {
    const bool isArray = open_.back() == kArray;
    if (told()) isArray ? events_.endArray() : events_.endMap();
    if (skippedFrom_ == open_.size()) skippedFrom_ = 0;
    open_.pop_back();
  }
  /// A key, whose token has been read, and the beginning of its value.
  void pair(int t) {
    if (t != kText && t != kTextRef) fail("a text as key", fmt::format("token 0x{:02x}", t));
    const std::string& name = t == kText ? text() : definedText();
    if (told()) events_.key(name);
    begin(token());
  }

  void begin(int t) {
    const std::uint64_t place = file_.position() - 1;
    switch (t) {
      case kArray: return open(t, told() && events_.beginArray(place));
      case kMap: return open(t, told() && events_.beginMap());
      case kUniformArray: return uniformArray(place);
      case kText:
      case kTextRef: return textValue(t == kText ? text() : definedText());
      case kNull:
        if (told()) events_.null();
        return;
      case kFalse:
      case kTrue: return boolean(t == kTrue);
      case kBool: return boolean(byte() != 0);
      default: return scalar(t);
    }
  }
  void textValue(const std::string& value) {
    if (told()) events_.text(value);
  }
  void boolean(bool value) {
    if (told()) events_.boolean(value);
  }
  void scalar(int t) {
    const std::optional<NumberType> type = numberType(t);
    if (!type) fail("a value", fmt::format("token 0x{:02x}", t));
    const std::uint64_t bits = number(static_cast<int>(numberSize(*type)));
    if (!told()) return;
    withNumberType(*type, [&]<class T>(T value) {
      std::memcpy(&value, reinterpret_cast<const std::byte*>(&bits), sizeof value);
      if constexpr (std::is_integral_v<T>)
        events_.integer(value);
      else
        events_.real(static_cast<double>(value));
    });
  }

  void uniformArray(std::uint64_t place) {
    const int t = byte();
    const std::uint64_t count = length();
    const bool wanted = told() && events_.beginArray(place);
    if (t == kBool)
      bits(count, wanted);
    else if (const std::optional<NumberType> type = numberType(t))
      wanted ? run(*type, count) : skip(count, numberSize(*type));
    else if (t == kText || t == kTextRef)
      for (std::uint64_t k = 0; k < count; ++k) {
        const std::string& value = t == kText ? text() : definedText();
        if (wanted) events_.text(value);
      }
    else
      fail("an array of numbers, bools or texts", fmt::format("token 0x{:02x}", t));
    if (wanted) events_.endArray();
  }
  void run(NumberType type, std::uint64_t count) {
    const std::size_t size = numberSize(type), most = kBlockBytes / size;
    block_.resize(kBlockBytes);
    while (count > 0) {
      const std::size_t here = std::min<std::uint64_t>(count, most);
      if (file_.read(block_.data(), here * size) != here * size) failAtEnd();
      events_.numbers(type, block_.data(), here);
      count -= here;
    }
  }
  /// Bools stand in words of 32 bits, the first in the least one.
  void bits(std::uint64_t count, bool wanted) {
    constexpr std::uint64_t kBits = 32;
    for (std::uint64_t k = 0; k < count; k += kBits) {
      const std::uint64_t word = number(4);
      for (std::uint64_t b = 0; wanted && b < std::min(kBits, count - k); ++b) events_.boolean((word >> b & 1) != 0);
      if (k > UINT64_MAX - kBits) break;
    }
  }

  UnpackedFile& file_;
  JsonEvents& events_;
  std::vector<char> open_;       ///< kArray or kMap
  std::size_t skippedFrom_ = 0;  ///< so many are open where stepping over began; 0: nothing is stepped over
  std::unordered_map<std::uint64_t, std::string> texts_;
  std::uint64_t textBytes_ = 0;
  std::string text_;  ///< the last that stood in the file
  std::vector<std::byte> block_;
};

}  // namespace

void readBinaryJson(UnpackedFile& file, JsonEvents& events) { BinaryJson(file, events).value(); }

}  // namespace mote
