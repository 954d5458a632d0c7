#include "host/scene/scene_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace mote {
namespace {

constexpr std::string_view kNoMatter[] = {"/frames/first", "/frames/last", "/frames/step", "/output/file"};

void append(std::string& text, const JsonNode& node, const std::string& pointer) {
  switch (node.kind) {
    case JsonNode::Kind::Null: text += "null"; return;
    case JsonNode::Kind::Boolean: text += node.boolean ? "true" : "false"; return;
    case JsonNode::Kind::Number: text += fmt::format("{}", node.number); return;
    case JsonNode::Kind::String: text += nlohmann::json(node.text).dump(); return;
    case JsonNode::Kind::Array:
      text += '[';
      for (const JsonNode& item : node.items) append(text, item, pointer + "/-"), text += ',';
      text += ']';
      return;
    case JsonNode::Kind::Object: break;
  }
  std::vector<const JsonMember*> members;
  for (const JsonMember& member : node.members) members.push_back(&member);
  std::sort(members.begin(), members.end(), [](const auto* a, const auto* b) { return a->key < b->key; });
  text += '{';
  for (const JsonMember* member : members) {
    const std::string child = childPointer(pointer, member->key);
    if (std::find(std::begin(kNoMatter), std::end(kNoMatter), child) != std::end(kNoMatter)) continue;
    std::string value;
    append(value, member->value, child);
    if (value == "{}") continue;  // "frames" may be left of what does not matter
    text += nlohmann::json(member->key).dump() + ':' + value + ',';
  }
  text += '}';
}

}  // namespace

std::string sceneSettings(const JsonNode& root) {
  std::string text;
  append(text, root, "");
  return text;
}

}  // namespace mote
