#include "host/particles/formats/component_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "host/core/error.h"

namespace mote {
namespace {

struct Vector {
  std::array<std::string_view, 3> components;
  std::string_view name;
};
constexpr Vector kVectors[] = {{{"x", "y", "z"}, "Position"},    {{"X", "Y", "Z"}, "Position"},
                               {{"px", "py", "pz"}, "Position"}, {{"vx", "vy", "vz"}, "Velocity"},
                               {{"nx", "ny", "nz"}, "Normal"},   {{"r", "g", "b"}, "Color"},
                               {{"R", "G", "B"}, "Color"},       {{"red", "green", "blue"}, "Color"}};
constexpr std::string_view kEndings[] = {"_x", "_y", "_z", ".x", ".y", ".z"};

/// Whether the scalar c[k] stands where component k of a vector that begins with c[0] would.
bool follows(const PlacedChannel* c, std::size_t k) {
  return c[k].channel.arity == 1 && c[k].channel.type == c[0].channel.type &&
         c[k].offset == c[0].offset + k * numberSize(c[0].channel.type);
}

bool sideBySide(const PlacedChannel* c) { return follows(c, 0) && follows(c, 1) && follows(c, 2); }

/// NAME[0] NAME[1] … from c on: how many of at most `most`, and NAME.
std::pair<std::size_t, std::string> numbered(const PlacedChannel* c, std::size_t most) {
  const std::string& first = c[0].channel.name;
  if (first.size() <= 3 || !first.ends_with("[0]") || !follows(c, 0)) return {0, ""};
  const std::string name = first.substr(0, first.size() - 3);
  std::size_t count = 1;
  while (count < most && follows(c, count) && c[count].channel.name == fmt::format("{}[{}]", name, count)) ++count;
  return {count, name};
}

/// The name of the vector that three scalars are.
std::optional<std::string> vectorName(const PlacedChannel* c) {
  for (const Vector& vector : kVectors)
    if (std::equal(vector.components.begin(), vector.components.end(), c,
                   [](std::string_view name, const PlacedChannel& own) { return own.channel.name == name; }))
      return std::string(vector.name);
  for (std::size_t first = 0; first < std::size(kEndings); first += 3) {
    const std::string& name = c[0].channel.name;
    if (name.size() <= 2 || !name.ends_with(kEndings[first])) continue;
    const std::string base = name.substr(0, name.size() - 2);
    if (c[1].channel.name == base + std::string(kEndings[first + 1]) &&
        c[2].channel.name == base + std::string(kEndings[first + 2]))
      return base;
  }
  return std::nullopt;
}

double scaleOfColor(NumberType type) {
  return type == NumberType::U8 ? 1.0 / 255 : type == NumberType::U16 ? 1.0 / 65535 : 1;
}

}  // namespace

std::vector<PlacedChannel> withVectors(const std::vector<PlacedChannel>& columns) {
  std::vector<PlacedChannel> channels;
  const auto taken = [&](const std::string& name) {
    return std::any_of(columns.begin(), columns.end(), [&](const auto& c) { return c.channel.name == name; }) ||
           std::any_of(channels.begin(), channels.end(), [&](const auto& c) { return c.channel.name == name; });
  };
  for (std::size_t k = 0; k < columns.size();) {
    const PlacedChannel* c = &columns[k];
    std::optional<std::string> name;
    std::size_t arity = 3;
    if (k + 3 <= columns.size() && sideBySide(c)) name = vectorName(c);
    if (auto [count, of] = numbered(c, columns.size() - k); count >= 2) name = std::move(of), arity = count;
    if (!name || taken(*name)) {
      channels.push_back(columns[k++]);
      continue;
    }
    PlacedChannel vector = *c;
    vector.channel.name = *name, vector.channel.arity = static_cast<std::uint32_t>(arity);
    if (*name == "Color" && arity == 3) vector.channel.scale = scaleOfColor(vector.channel.type);
    channels.push_back(vector);
    k += arity;
  }
  return channels;
}

std::vector<PlacedChannel> plainColumns(const std::string& path, std::size_t width, NumberType type) {
  if (width < 3)
    throw InputError(path, "columns", "three or more, the first three of which are a position",
                     fmt::format("{} number{} a particle", width, width == 1 ? "" : "s"));
  requireFewChannels(path, width);
  std::vector<PlacedChannel> channels;
  const auto add = [&](std::string name, std::uint32_t arity, std::size_t column) {
    channels.emplace_back(std::move(name), type, arity, column * numberSize(type));
  };
  add("Position", 3, 0);
  if (width == 4) add("Density", 1, 3);
  if (width == 6) add("Velocity", 3, 3);
  if (width != 4 && width != 6)
    for (std::size_t column = 3; column < width; ++column) add(fmt::format("Column{}", column), 1, column);
  return channels;
}

}  // namespace mote
