#include "host/scene/json_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "host/core/error.h"
#include "host/scene/json_cursor.h"

namespace mote {
namespace {

using nlohmann::json;

/// Receives nlohmann's events and builds the tree; the cursor supplies the places. Throws InputError.
class TreeBuilder final : public nlohmann::json_sax<json> {
 public:
  /// `file`: messages say name:line:column, else just the name. `at`: pointer of the text's root in the document.
  TreeBuilder(const std::string& name, std::string_view text, std::uint32_t source, bool file, std::string_view at)
      : name_(name), source_(source), file_(file), at_(at), cursor_(text) {}

  JsonNode take() { return std::move(root_); }

  bool null() override { return add(JsonNode::Kind::Null), true; }
  bool boolean(bool value) override { return add(JsonNode::Kind::Boolean).boolean = value, true; }
  bool number_integer(number_integer_t value) override { return addNumber(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return addNumber(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return addNumber(value); }
  bool string(string_t& value) override { return add(JsonNode::Kind::String).text = std::move(value), true; }
  bool binary(binary_t&) override { return false; }  // not in JSON text

  bool start_object(std::size_t) override { return open(JsonNode::Kind::Object); }
  bool start_array(std::size_t) override { return open(JsonNode::Kind::Array); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& key) override {
    const JsonPlace place{source_, cursor_.take(JsonToken::Key)};
    Open& object = open_.back();
    const auto [earlier, unique] = object.keys.emplace(key, place.offset);
    if (!unique)
      throw InputError(where(place.offset), childPointer(pointer(), key), "each key once in an object",
                       fmt::format("the key {} again", quotedForMessage(key)),
                       fmt::format("it is first given at {}", cursor_.lineAndColumn(earlier->second)));
    object.node->members.push_back({key, place, {}});
    return true;
  }

  bool parse_error(std::size_t, const std::string&, const json::exception& error) override {
    const JsonSyntaxError what = cursor_.explain(error.what());
    throw InputError(where(what.offset), pointer(), what.expected, what.got, what.hint);
  }

 private:
  struct Open {
    JsonNode* node;
    std::unordered_map<std::string, std::size_t> keys;
  };

  std::string where(std::size_t offset) const {
    return file_ ? fmt::format("{}:{}", name_, cursor_.lineAndColumn(offset)) : name_;
  }

  /// Of the innermost open array or object.
  std::string pointer() const {
    std::string result(at_);
    for (std::size_t i = 0; i + 1 < open_.size(); ++i) {
      const JsonNode& node = *open_[i].node;
      result = node.kind == JsonNode::Kind::Object ? childPointer(result, node.members.back().key)
                                                   : childPointer(result, std::to_string(node.items.size() - 1));
    }
    return result;
  }

  JsonNode& add(JsonNode::Kind kind, JsonToken token = JsonToken::Value) {
    JsonNode node;
    node.kind = kind;
    node.place = {source_, cursor_.take(token)};
    if (open_.empty()) return root_ = std::move(node);
    JsonNode& parent = *open_.back().node;
    if (parent.kind == JsonNode::Kind::Array) return parent.items.emplace_back(std::move(node));
    return parent.members.back().value = std::move(node);
  }

  bool addNumber(double value) {
    JsonNode& node = add(JsonNode::Kind::Number);
    node.number = value;
    node.text = cursor_.since(node.place.offset);
    return true;
  }

  bool open(JsonNode::Kind kind) {
    JsonNode& node = add(kind, kind == JsonNode::Kind::Object ? JsonToken::OpenObject : JsonToken::OpenArray);
    if (open_.size() == kMaxJsonDepth)
      throw InputError(where(node.place.offset), "",
                       fmt::format("at most {} arrays and objects within each other", kMaxJsonDepth), "more");
    // Stays valid while it is open: only the innermost node grows, and that is never a sibling of an open one.
    open_.push_back({&node, {}});
    return true;
  }

  bool close() {
    cursor_.take(JsonToken::Close);
    open_.pop_back();
    return true;
  }

  const std::string& name_;
  std::uint32_t source_;
  bool file_;
  std::string_view at_;
  JsonCursor cursor_;
  JsonNode root_;
  std::vector<Open> open_;
};

JsonNode parseTree(const std::string& name, std::string_view text, std::uint32_t source, bool file,
                   std::string_view at = {}) {
  TreeBuilder builder(name, text, source, file, at);
  // nlohmann takes a zero byte for the end of the text and would not see what follows.
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos)
    throw InputError(file ? fmt::format("{}:{}", name, JsonCursor(text).lineAndColumn(zero)) : name, "", "JSON text",
                     "a zero byte", "is this a binary file?");
  json::sax_parse(text.begin(), text.end(), &builder, json::input_format_t::json, true, true);
  return builder.take();
}

/// The steps of an RFC 6901 pointer, unescaped.
std::vector<std::string> pointerSteps(const std::string& flag, std::string_view pointer) {
  const auto bad = [&](std::string_view hint) {
    return InputError(flag, "", "a JSON pointer such as /lights/0/intensity", quotedForMessage(pointer), hint);
  };
  if (pointer.empty()) throw bad("it must name a key");
  if (pointer.front() != '/') throw bad("it begins with /");
  std::vector<std::string> steps;
  for (std::size_t i = 0; i < pointer.size(); ++i) {
    const char c = pointer[i];
    if (c == '/') {
      steps.emplace_back();
    } else if (c == '~') {
      const char escaped = i + 1 < pointer.size() ? pointer[i + 1] : '\0';
      if (escaped != '0' && escaped != '1') throw bad("~ is written ~0 and / in a key ~1");
      steps.back() += escaped == '0' ? '~' : '/';
      ++i;
    } else {
      steps.back() += c;
    }
  }
  return steps;
}

std::optional<std::size_t> arrayIndex(std::string_view step, std::size_t size) {
  if (step == "-") return size;
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(step.data(), step.data() + step.size(), index);
  const bool whole = error == std::errc{} && end == step.data() + step.size();
  const bool leadingZero = step.size() > 1 && step.front() == '0';
  return whole && !leadingZero && index <= size ? std::optional(index) : std::nullopt;
}

/// One step down from `node`; where nothing is there, it becomes `missing`.
JsonNode& descend(JsonNode& node, const std::string& step, const std::string& at, const std::string& flag,
                  JsonNode missing) {
  if (node.kind == JsonNode::Kind::Object) {
    const auto found =
        std::find_if(node.members.begin(), node.members.end(), [&](const JsonMember& m) { return m.key == step; });
    if (found != node.members.end()) return found->value;
    const JsonPlace place = missing.place;
    return node.members.emplace_back(JsonMember{step, place, std::move(missing)}).value;
  }
  const std::string shownAt = at.empty() ? "the scene" : at;
  if (node.kind != JsonNode::Kind::Array)
    throw InputError(flag, at, "an object or array to go into", node.shown(),
                     fmt::format("{} has no member {}", shownAt, quotedForMessage(step)));
  const auto index = arrayIndex(step, node.items.size());
  if (!index)
    throw InputError(flag, at, fmt::format("an index from 0 to {} (the last one appends)", node.items.size()),
                     quotedForMessage(step));
  if (*index == node.items.size()) node.items.push_back(std::move(missing));
  return node.items[*index];
}

JsonNode parseValue(const std::string& flag, std::string_view at, std::string_view value, std::uint32_t source) {
  const std::size_t first = value.find_first_not_of(" \t\r\n");
  const bool mustBeJson =
      first != std::string_view::npos && std::string_view("[{\"").find(value[first]) != std::string_view::npos;
  try {
    return parseTree(flag, value, source, false, at);
  } catch (const InputError&) {
    if (mustBeJson) throw;
  }
  JsonNode text;
  text.kind = JsonNode::Kind::String;
  text.place.source = source;
  text.text = value;
  return text;
}

}  // namespace

const JsonMember* JsonNode::find(std::string_view key) const {
  const auto found = std::find_if(members.begin(), members.end(), [&](const JsonMember& m) { return m.key == key; });
  return found == members.end() ? nullptr : &*found;
}

std::string JsonNode::shown() const {
  switch (kind) {
    case Kind::Null: return "null";
    case Kind::Boolean: return boolean ? "true" : "false";
    case Kind::Number: return text.size() <= 40 ? text : text.substr(0, 40) + "...";
    case Kind::String: return quotedForMessage(text);
    case Kind::Array: return fmt::format("an array of {}", items.size());
    case Kind::Object: return "an object";
  }
  return {};
}

JsonDocument::JsonDocument(std::string path, std::string_view text) : sources_{{std::move(path), std::string(text)}} {
  root_ = parseTree(sources_[0].name, sources_[0].text, 0, true);
}

void JsonDocument::set(std::string_view assignment) {
  const auto source = static_cast<std::uint32_t>(sources_.size());
  const std::string flag = fmt::format("--set {}", assignment);
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos)
    throw InputError("--set", "", "/json/pointer=VALUE", quotedForMessage(assignment), "there is no =");
  const std::string_view pointer = assignment.substr(0, equals);
  // Parsed before the tree is touched.
  const std::vector<std::string> steps = pointerSteps(flag, pointer);
  JsonNode value = parseValue(flag, pointer, assignment.substr(equals + 1), source);
  sources_.push_back({flag, {}});
  JsonNode* node = &root_;
  std::string at;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    JsonNode missing;
    const bool goesOnInArray = i + 1 < steps.size() && (steps[i + 1] == "0" || steps[i + 1] == "-");
    missing.kind = goesOnInArray ? JsonNode::Kind::Array : JsonNode::Kind::Object;
    missing.place.source = source;
    node = &descend(*node, steps[i], at, flag, std::move(missing));
    at = childPointer(at, steps[i]);
  }
  *node = std::move(value);
}

std::string JsonDocument::where(JsonPlace place) const {
  const Source& source = sources_[place.source];
  if (place.source > 0) return source.name;
  return fmt::format("{}:{}", source.name, JsonCursor(source.text).lineAndColumn(place.offset));
}

std::string quotedForMessage(std::string_view text) {
  constexpr std::size_t kMaxLength = 60;  // a message stays a line or two
  std::string result = "\"";
  std::size_t end = std::min(text.size(), kMaxLength);
  while (end < text.size() && end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80)
    --end;  // whole characters
  for (const char c : text.substr(0, end)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      result += fmt::format("\\x{:02x}", byte);
    } else {
      result += c;
    }
  }
  return result + (end < text.size() ? "...\"" : "\"");
}

std::string childPointer(std::string_view pointer, std::string_view key) {
  std::string result(pointer);
  result += '/';
  for (const char c : key) {
    if (c == '~') {
      result += "~0";
    } else if (c == '/') {
      result += "~1";
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace mote
