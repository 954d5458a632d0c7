#include <fmt/format.h>

#include <cstddef>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/particles/formats/json_events.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

using Json = nlohmann::json;

/// Bytes of a text or a number, with the blanks in front of it.
constexpr std::uint64_t kMostValue = 1 << 24;

/// The file's bytes, for the library; nothing longer than kMostValue may stand between two events.
struct Chars {
  UnpackedFile& file;
  std::uint64_t lastEvent;

  void advance() {
    file.next();
    if (file.position() - lastEvent > kMostValue)
      throw InputError(file.path(), fmt::format("JSON, byte {}", lastEvent),
                       fmt::format("texts and numbers of {} bytes at most", kMostValue), "a longer one");
  }
};

class CharIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = char;

  explicit CharIterator(Chars* chars) : chars_(chars) {}  // null: the end

  char operator*() const { return static_cast<char>(chars_->file.peek()); }
  CharIterator& operator++() { return chars_->advance(), *this; }
  CharIterator operator++(int) { return ++*this; }
  bool operator==(const CharIterator& other) const { return atEnd() == other.atEnd(); }
  bool operator!=(const CharIterator& other) const { return !(*this == other); }

 private:
  bool atEnd() const { return !chars_ || chars_->file.peek() < 0; }
  Chars* chars_;
};

/// From the library's events to ours.
class Translator {
 public:
  Translator(Chars& chars, JsonEvents& events) : chars_(chars), events_(events) {}

  bool null() { return events_.null(), eventDone(); }
  bool boolean(bool value) { return events_.boolean(value), eventDone(); }
  bool number_integer(Json::number_integer_t value) { return events_.integer(value), eventDone(); }
  bool number_unsigned(Json::number_unsigned_t value) {
    if (value <= INT64_MAX)
      events_.integer(static_cast<std::int64_t>(value));
    else
      events_.real(static_cast<double>(value));
    return eventDone();
  }
  bool number_float(Json::number_float_t value, const std::string&) { return events_.real(value), eventDone(); }
  bool string(std::string& value) { return events_.text(value), eventDone(); }
  bool binary(Json::binary_t&) { return eventDone(); }
  bool key(std::string& name) { return events_.key(name), eventDone(); }
  bool start_array(std::size_t) {
    skipped_ = !events_.beginArray(chars_.file.position() - 1);
    return skipped_ ? skip() : eventDone();
  }
  bool start_object(std::size_t) {
    skipped_ = !events_.beginMap();
    return skipped_ ? skip() : eventDone();
  }
  bool end_array() {
    if (!skipped_) events_.endArray();
    skipped_ = false;
    return eventDone();
  }
  bool end_object() {
    if (!skipped_) events_.endMap();
    skipped_ = false;
    return eventDone();
  }
  bool parse_error(std::size_t, const std::string& token, const nlohmann::detail::exception& error) {
    const bool cut = chars_.file.peek() < 0;
    throw InputError(chars_.file.path(), fmt::format("JSON, byte {}", chars_.file.position()), "valid JSON",
                     cut ? "the file's end" : shown(token),
                     cut ? "the file is cut off" : fmt::format("{}", error.what()));
  }

 private:
  bool eventDone() {
    chars_.lastEvent = chars_.file.position();
    return true;
  }
  /// To the end of the array or map that has begun, which the library sees as an empty one. It has read no byte ahead.
  bool skip() {
    for (int depth = 0, c = chars_.file.peek(); c >= 0; c = chars_.file.peek()) {
      if ((c == ']' || c == '}') && depth-- == 0) break;
      if (c == '[' || c == '{') ++depth;
      chars_.file.next();
      if (c == '"') skipText();
    }
    return eventDone();
  }
  void skipText() {
    for (int c = chars_.file.next(); c >= 0 && c != '"'; c = chars_.file.next())
      if (c == '\\') chars_.file.next();
  }

  Chars& chars_;
  JsonEvents& events_;
  bool skipped_ = false;
};

}  // namespace

void readTextJson(UnpackedFile& file, JsonEvents& events) {
  Chars chars{file, file.position()};
  Translator translator(chars, events);
  constexpr bool kWholeFile = false;  // a value may stand anywhere
  Json::sax_parse(CharIterator(&chars), CharIterator(nullptr), &translator, Json::input_format_t::json, kWholeFile);
}

}  // namespace mote
