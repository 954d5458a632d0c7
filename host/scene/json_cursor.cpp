#include "host/scene/json_cursor.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/scene/json_tree.h"

namespace mote {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

}  // namespace

JsonCursor::JsonCursor(std::string_view text) : text_(text), at_(text.starts_with(kByteOrderMark) ? 3 : 0) {}

std::size_t JsonCursor::take(JsonToken token) {
  char separator = 0;
  const std::size_t begin = nextToken(separator);
  at_ = tokenEnd(begin);
  if (token == JsonToken::OpenObject || token == JsonToken::OpenArray)
    open_.push_back({token == JsonToken::OpenObject, begin});
  else if (token == JsonToken::Close && !open_.empty())
    open_.pop_back();
  last_ = token;
  return begin;
}

std::size_t JsonCursor::nextToken(char& separator) const {
  std::size_t at = skipBlanks(at_);
  const bool afterEntry = !open_.empty() && (last_ == JsonToken::Value || last_ == JsonToken::Close);
  const char legal = last_ == JsonToken::Key ? ':' : afterEntry ? ',' : '\0';
  if (legal && at < text_.size() && text_[at] == legal) {
    separator = legal;
    at = skipBlanks(at + 1);
  }
  return at;
}

std::size_t JsonCursor::skipBlanks(std::size_t at) const {
  for (;;) {
    at = std::min(text_.find_first_not_of(" \t\r\n", at), text_.size());
    const std::string_view rest = text_.substr(at);
    if (rest.starts_with("//")) {
      at = std::min(text_.find_first_of("\r\n", at), text_.size());
    } else {
      const std::size_t end = rest.starts_with("/*") ? text_.find("*/", at + 2) : text_.npos;
      if (end == text_.npos) return at;
      at = end + 2;
    }
  }
}

std::size_t JsonCursor::tokenEnd(std::size_t begin) const {
  std::size_t at = begin;
  const auto is = [&](auto predicate) { return at < text_.size() && predicate(text_[at]); };
  const auto digits = [&] {
    while (is(isDigit)) ++at;
  };
  if (is([](char c) { return c == '"'; })) {
    for (++at; at < text_.size() && text_[at] != '"'; ++at)
      if (text_[at] == '\\') ++at;
    return std::min(at + 1, text_.size());
  }
  if (is([](char c) { return c == '-' || isDigit(c); })) {
    // As the grammar has it: "01" is the number 0 and an error after it.
    if (text_[at] == '-') ++at;
    if (is([](char c) { return c == '0'; })) {
      ++at;
    } else {
      digits();
    }
    if (is([](char c) { return c == '.'; })) ++at, digits();
    if (is([](char c) { return c == 'e' || c == 'E'; })) {
      ++at;
      if (is([](char c) { return c == '+' || c == '-'; })) ++at;
      digits();
    }
    return at;
  }
  const auto isLetter = [](char c) { return c >= 'a' && c <= 'z'; };
  if (!is(isLetter)) return std::min(at + 1, text_.size());  // a bracket
  while (is(isLetter)) ++at;
  return at;
}

JsonSyntaxError JsonCursor::explain(std::string_view parserMessage) const {
  char separator = 0;
  const std::size_t at = nextToken(separator);
  const bool ended = at >= text_.size();
  const char c = ended ? '\0' : text_[at];
  const std::string got = shownAt(at);
  const bool inObject = !open_.empty() && open_.back().object;

  if (contains(parserMessage, "number overflow")) return {at, "a number that a double can hold", got, {}};
  if (contains(parserMessage, "invalid BOM")) return {0, "UTF-8 text", "a broken byte order mark", {}};
  if (last_ == JsonToken::None && (ended || text_.find_first_not_of(" \t\r\n") == text_.npos))
    return {0, "a JSON object", "an empty file", R"(a scene needs at least {"particles":[{"file":"x.prt"}]})"};
  if (c == '/') return {at, "a comment that begins with // or is closed by */", got, {}};
  if (c == '"' && contains(parserMessage, "invalid string")) {
    if (contains(parserMessage, "UTF-8")) return {at, "UTF-8 text", "bytes that are not UTF-8 in this string", {}};
    if (contains(parserMessage, "missing closing quote") || contains(parserMessage, "U+000A") ||
        contains(parserMessage, "U+000D"))
      return {at, "a closing quote on the same line", "a string without one", {}};
    const std::size_t begin = parserMessage.find("invalid string: ") + 16;
    return {
        at, "a valid string", std::string(parserMessage.substr(begin, parserMessage.find("; last read") - begin)), {}};
  }
  if (ended && !open_.empty())
    return {text_.size(),
            fmt::format("a closing {} for the {} at {}", inObject ? '}' : ']', inObject ? '{' : '[',
                        lineAndColumn(open_.back().offset)),
            "the end of the file",
            {}};
  if (open_.empty() && last_ != JsonToken::None) return {at, "the end of the file after the scene", got, {}};
  if (separator == ',' && (c == '}' || c == ']'))
    return {at, "another entry after the comma", got, "JSON allows no comma after the last entry"};
  if (last_ == JsonToken::Key && separator != ':') return {at, "a colon after the key", got, {}};
  if ((last_ == JsonToken::Value || last_ == JsonToken::Close) && separator != ',')
    return {at, fmt::format("a comma or a closing {}", inObject ? '}' : ']'), got,
            c == '}' || c == ']' ? "" : "is a comma missing?"};
  if (inObject && last_ != JsonToken::Key && c != '"') return {at, "a key in double quotes", got, {}};
  return {at, "a JSON value (a number, \"text\", true, false, null, [...] or {...})", got,
          c == '\'' ? "text stands in double quotes" : ""};
}

std::string JsonCursor::shownAt(std::size_t offset) const {
  if (offset >= text_.size()) return "the end of the file";
  std::size_t end = text_.find_first_of(" \t\r\n,:{}[]\"", offset);
  end = text_[offset] == '"' ? tokenEnd(offset) : std::max(std::min(end, text_.size()), offset + 1);
  std::string shown;
  for (const char c : text_.substr(offset, std::min<std::size_t>(end - offset, 40))) {
    const auto byte = static_cast<unsigned char>(c);
    shown += byte < 0x20 || byte >= 0x7f ? fmt::format("\\x{:02x}", byte) : std::string(1, c);
  }
  return shown;
}

std::string JsonCursor::lineAndColumn(std::size_t offset) const {
  const std::string_view before = text_.substr(0, offset);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t newline = before.rfind('\n');
  std::string_view row = newline == before.npos ? before : before.substr(newline + 1);
  if (newline == before.npos && row.starts_with(kByteOrderMark)) row.remove_prefix(3);
  const auto characters =
      std::count_if(row.begin(), row.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; });
  return fmt::format("{}:{}", line, characters + 1);
}

}  // namespace mote
