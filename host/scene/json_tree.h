// A JSON text as a tree in which every key and value knows its place, and changes to it from `--set` flags.
//
// nlohmann-json does the lexing and the grammar; it keeps no places and takes duplicate keys silently, so the tree is
// built from its events with a cursor that walks the same text.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mote {

/// Where a key or value begins: a byte of source 0 (the file) or of source n (the n-th `--set`).
struct JsonPlace {
  std::uint32_t source = 0;
  std::size_t offset = 0;
};

struct JsonMember;

struct JsonNode {
  enum class Kind { Null, Boolean, Number, String, Array, Object };
  Kind kind = Kind::Null;
  JsonPlace place;
  bool boolean = false;
  double number = 0;
  std::string text;                 ///< String: its value, valid UTF-8; Number: the literal as written
  std::vector<JsonNode> items;      ///< Array
  std::vector<JsonMember> members;  ///< Object, in the order of the text; keys are unique

  /// The member of that key, or null.
  const JsonMember* find(std::string_view key) const;
  /// Short, for messages: the literal, the string in quotes, "an array of 2", "an object".
  std::string shown() const;
};

struct JsonMember {
  std::string key;
  JsonPlace place;  ///< of the key
  JsonNode value;
};

/// Deeper nesting than this is refused: no scene needs it, and code that walks the tree may recurse.
constexpr int kMaxJsonDepth = 64;

class JsonDocument {
 public:
  /// Parses UTF-8 text, with // and /* */ comments and a byte order mark allowed. Throws InputError "path:line:column:
  /// …" for syntax errors, duplicate keys, numbers beyond double and nesting beyond kMaxJsonDepth.
  JsonDocument(std::string path, std::string_view text);

  /// Applies "/json/pointer=VALUE" (RFC 6901). VALUE is JSON; what is not JSON and does not begin with [ { or " is
  /// taken as a string. Missing objects on the way are made, an array takes existing indices, its length or "-"
  /// (append). Throws InputError naming `--set`.
  void set(std::string_view assignment);

  const JsonNode& root() const { return root_; }
  /// "scene.json:14:20" (column in characters, from 1), or "--set /json/pointer=VALUE".
  std::string where(JsonPlace place) const;

 private:
  struct Source {
    std::string name, text;
  };
  std::vector<Source> sources_;
  JsonNode root_;
};

/// Text in double quotes for a message: control bytes as \xNN, cut after 60 characters.
std::string quotedForMessage(std::string_view text);

/// `key` as one more step of a JSON pointer ("~" and "/" escaped).
std::string childPointer(std::string_view pointer, std::string_view key);

}  // namespace mote
