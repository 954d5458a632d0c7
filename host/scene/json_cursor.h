// A place in JSON text that keeps step with a parser's events, and explains in words where the grammar is broken.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace mote {

enum class JsonToken { None, OpenObject, OpenArray, Close, Key, Value };

/// The parts of a message about a syntax error.
struct JsonSyntaxError {
  std::size_t offset = 0;
  std::string expected, got, hint;
};

/// Walks the text token by token. It relies on the parser having accepted each token that it is told to take.
class JsonCursor {
 public:
  explicit JsonCursor(std::string_view text);

  /// Moves over the next token (and the blanks, comments and separator before it); returns where it begins.
  std::size_t take(JsonToken token);
  /// The text from `offset` to here.
  std::string_view since(std::size_t offset) const { return text_.substr(offset, at_ - offset); }
  /// Why the parser could not go on from here. `parserMessage`: what it says itself.
  JsonSyntaxError explain(std::string_view parserMessage) const;

  /// "14:20": line and column from 1, the column in characters.
  std::string lineAndColumn(std::size_t offset) const;

 private:
  /// Where the next token begins; `separator` is the ',' or ':' that was skipped, or 0.
  std::size_t nextToken(char& separator) const;
  std::size_t skipBlanks(std::size_t at) const;
  std::size_t tokenEnd(std::size_t begin) const;
  std::string shownAt(std::size_t offset) const;

  std::string_view text_;
  std::size_t at_ = 0;
  JsonToken last_ = JsonToken::None;
  struct Open {
    bool object;
    std::size_t offset;
  };
  std::vector<Open> open_;
};

}  // namespace mote
