#include "host/scene/gltf/gltf_value.h"

#include <fmt/format.h>

#include <cmath>

#include "host/core/error.h"

namespace mote {

using Kind = JsonNode::Kind;

GltfValue GltfValue::member(std::string_view key) const {
  if (node_ && node_->kind != Kind::Object) refuse("an object", node_->shown());
  const JsonMember* found = node_ ? node_->find(key) : nullptr;
  return {*file_, found ? &found->value : nullptr, childPointer(pointer_, key)};
}

std::size_t GltfValue::size() const {
  if (node_ && node_->kind != Kind::Array) refuse("an array", node_->shown());
  return node_ ? node_->items.size() : 0;
}

GltfValue GltfValue::item(std::size_t i) const {
  MOTE_CHECK(i, <, size());
  return {*file_, &node_->items[i], fmt::format("{}/{}", pointer_, i)};
}

double GltfValue::number(double fallback, const Range& range) const { return node_ ? number(range) : fallback; }

double GltfValue::number(const Range& range) const {
  const bool good = node_ && node_->kind == Kind::Number && isInside(node_->number, range);
  if (!good) refuse(rangeText("a number", range), node_ ? node_->shown() : "none");
  return node_->number;
}

bool GltfValue::boolean(bool fallback) const {
  if (!node_) return fallback;
  if (node_->kind != Kind::Boolean) refuse("true or false", node_->shown());
  return node_->boolean;
}

std::string GltfValue::text() const {
  if (!node_) return {};
  if (node_->kind != Kind::String) refuse("text", node_->shown());
  return node_->text;
}

std::size_t GltfValue::index(std::size_t count, std::string_view nouns) const {
  const bool whole = node_ && node_->kind == Kind::Number && std::trunc(node_->number) == node_->number;
  if (!whole || node_->number < 0 || node_->number >= static_cast<double>(count))
    refuse(count == 0 ? fmt::format("none of {}, as there are none", nouns)
                      : fmt::format("an index of {}, 0 to {}", nouns, count - 1),
           node_ ? node_->shown() : "none");
  return static_cast<std::size_t>(node_->number);
}

std::uint64_t GltfValue::size64(std::uint64_t fallback) const {
  if (!node_) return fallback;
  const bool good = node_->kind == Kind::Number && std::trunc(node_->number) == node_->number && node_->number >= 0 &&
                    node_->number <= 0x1p53;
  if (!good) refuse("a whole number >= 0", node_->shown());
  return static_cast<std::uint64_t>(node_->number);
}

bool GltfValue::numbers(double* values, std::size_t count) const {
  if (!node_) return false;
  if (node_->kind != Kind::Array || node_->items.size() != count)
    refuse(fmt::format("an array of {} numbers", count), node_->shown());
  for (std::size_t i = 0; i < count; ++i) values[i] = item(i).number(Range{});
  return true;
}

void GltfValue::refuse(std::string_view expected, std::string_view got, std::string_view hint) const {
  throw InputError(*file_, pointer_, expected, got, hint);
}

}  // namespace mote
