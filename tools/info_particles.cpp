// The particle files' part of `mote info`: statistics of raw channels, whatever their types.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "host/core/parallel.h"
#include "host/particles/file_units.h"
#include "host/particles/formats/number_visit.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/our_channels.h"
#include "host/particles/spacing.h"
#include "host/particles/wide_positions.h"
#include "tools/info.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kGrain = 1 << 16;
constexpr std::uint64_t kBytesAtOnce = 1ull << 30;

template <class T>
T numberAt(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// What numbers of type T are compared and shown as: exact, so that 64-bit ids keep all their digits.
template <class T>
using Shown = std::conditional_t<std::is_integral_v<T>, T, double>;

template <class T>
Shown<T> shown(T value) {
  return static_cast<Shown<T>>(value);
}

/// Of one component of a channel, over its finite numbers.
template <class T>
struct Statistics {
  Shown<T> least{}, greatest{};
  double sum = 0;
  std::uint64_t finite = 0;

  void add(Shown<T> value) {
    if constexpr (!std::is_integral_v<T>)
      if (!std::isfinite(value)) return;
    least = finite > 0 ? std::min(least, value) : value;
    greatest = finite > 0 ? std::max(greatest, value) : value;
    sum += static_cast<double>(value), ++finite;
  }
  void add(const Statistics& other) {
    if (other.finite == 0) return;
    least = finite > 0 ? std::min(least, other.least) : other.least;
    greatest = finite > 0 ? std::max(greatest, other.greatest) : other.greatest;
    sum += other.sum, finite += other.finite;
  }
};

template <class T>
struct Block {
  std::vector<Statistics<T>> components;
  std::uint64_t notFinite = 0;  ///< particles with any
};

template <class T>
Json statisticsOf(const std::vector<std::byte>& raw, std::size_t count, std::uint32_t arity) {
  std::vector<Block<T>> blocks((count + kGrain - 1) / kGrain);
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    Block<T>& block = blocks[begin / kGrain];
    block.components.resize(arity);
    for (std::size_t i = begin; i < end; ++i) {
      const std::byte* particle = raw.data() + i * arity * sizeof(T);
      bool finite = true;
      for (std::uint32_t c = 0; c < arity; ++c) {
        const Shown<T> value = shown(numberAt<T>(particle + c * sizeof(T)));
        if constexpr (!std::is_integral_v<T>) finite = finite && std::isfinite(value);
        block.components[c].add(value);
      }
      block.notFinite += !finite;
    }
  });
  Block<T> all{std::vector<Statistics<T>>(arity), 0};
  for (const Block<T>& block : blocks) {
    for (std::uint32_t c = 0; c < arity; ++c) all.components[c].add(block.components[c]);
    all.notFinite += block.notFinite;
  }
  Json least = Json::array(), mean = Json::array(), greatest = Json::array();
  for (const Statistics<T>& s : all.components) {
    const bool any = s.finite > 0;
    least.push_back(any ? Json(s.least) : Json());
    mean.push_back(any ? Json(s.sum / static_cast<double>(s.finite)) : Json());
    greatest.push_back(any ? Json(s.greatest) : Json());
  }
  return {{"not_finite", all.notFinite}, {"min", least}, {"mean", mean}, {"max", greatest}};
}

/// `ours`: which of our channels it is, else "". Statistics are of the numbers as they stand in the file; `scale` is
/// what they are multiplied with.
Json channelJson(const Channel& channel, const std::string& ours, const std::vector<std::byte>& raw,
                 std::size_t count) {
  Json json = {{"name", channel.name}, {"type", numberName(channel.type)}, {"arity", channel.arity}};
  json["ours"] = ours.empty() ? Json() : Json(ours);
  if (channel.scale != 1) json["scale"] = channel.scale;
  json.update(withNumberType(channel.type, [&]<class T>(T) { return statisticsOf<T>(raw, count, channel.arity); }));
  return json;
}

/// All channels, as many in one pass over the file as fit the memory that is set aside for them.
Json channelsJson(const ParticleFile& file) {
  Json list = Json::array();
  const std::vector<Channel>& channels = file.channels();
  for (std::size_t begin = 0, end = 0; begin < channels.size(); begin = end) {
    std::uint64_t bytes = 0;
    while (end < channels.size() && (end == begin || bytes + file.count() * channels[end].bytes() <= kBytesAtOnce))
      bytes += file.count() * channels[end++].bytes();
    std::vector<std::vector<std::byte>> raw(end - begin);
    std::vector<ChannelRequest> requests;
    for (std::size_t k = begin; k < end; ++k) requests.push_back({channels[k].name, &raw[k - begin]});
    file.read(requests);
    for (std::size_t k = begin; k < end; ++k)
      list.push_back(channelJson(channels[k], ourNameOf(file, channels[k].name), raw[k - begin], file.count()));
  }
  return list;
}

Json metadataJson(const ParticleFile& file) {
  Json list = Json::array();
  for (const Metadata& m : file.metadata()) {
    Json entry = {{"channel", m.channel}, {"name", m.name}};
    if (m.type == kMetadataText) {
      entry["type"] = "text", entry["value"] = m.bytes;
    } else {
      const auto type = static_cast<NumberType>(m.type);
      Json values = Json::array();
      withNumberType(type, [&]<class T>(T) {
        for (std::size_t at = 0; at + sizeof(T) <= m.bytes.size(); at += sizeof(T))
          values.push_back(shown(numberAt<T>(reinterpret_cast<const std::byte*>(m.bytes.data()) + at)));
      });
      entry["type"] = numberName(type), entry["value"] = values;
    }
    list.push_back(std::move(entry));
  }
  return list;
}

/// The channel that is ours of this name.
const Json* channelNamed(const Json& channels, const char* name) {
  for (const Json& channel : channels)
    if (channel["ours"] == name) return &channel;
  return nullptr;
}

/// "radius": "auto" of the scene: 1.5 × the mean distance to the nearest 8, of the particles that have a place.
Json autoRadius(const ParticleFile& file, const std::string& position) {
  std::vector<vec3> positions;
  if (isWide(file.channel(position)->type)) {  // distances far from 0 as well
    std::vector<dvec3> wide;
    const ChannelRequest request{position, &wide};
    file.read({&request, 1});
    toFloats(wide, positions);
  } else {
    const ChannelRequest request{position, &positions};
    file.read({&request, 1});
  }
  std::erase_if(positions,
                [](const vec3& p) { return !(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)); });
  const double radius = kAutoRadiusFactor * meanNeighbourDistance(positions);
  if (!(radius > 0)) return {{"from", "none: there is no spacing to take it from"}};
  return {
      {"from", "auto: 1.5 × the mean distance to the nearest 8"}, {"min", radius}, {"mean", radius}, {"max", radius}};
}

Json radiusJson(const ParticleFile& file, const Json& channels) {
  if (const Json* radius = channelNamed(channels, "Radius"))
    return {{"from", "channel " + (*radius)["name"].get<std::string>()},
            {"min", (*radius)["min"][0]},
            {"mean", (*radius)["mean"][0]},
            {"max", (*radius)["max"][0]}};
  const Json* position = channelNamed(channels, "Position");
  if (!position || (*position)["arity"] < 3) return {{"from", "none: there is no Position of arity 3"}};
  return autoRadius(file, (*position)["name"]);
}

std::string valueText(const Json& value) {
  return value.is_null() ? "-" : value.is_number_float() ? fmt::format("{:.6g}", value.get<double>()) : value.dump();
}

/// "pscale (Radius)"
std::string nameText(const Json& channel) {
  const auto name = channel["name"].get<std::string>();
  return channel["ours"].is_null() || channel["ours"] == name
             ? name
             : fmt::format("{} ({})", name, channel["ours"].get<std::string>());
}

void printChannel(const Json& channel) {
  const auto arity = channel["arity"].get<std::size_t>();
  const auto type = channel["type"].get<std::string>();
  constexpr std::size_t kShownComponents = 16;
  for (std::size_t c = 0; c < std::min(arity, kShownComponents); ++c)
    fmt::print("  {:<23} {:<12} {:>14} {:>14} {:>14} {:>12}\n", c == 0 ? nameText(channel) : "",
               c > 0        ? ""
               : arity == 1 ? type
                            : fmt::format("{} × {}", arity, type),
               valueText(channel["min"][c]), valueText(channel["mean"][c]), valueText(channel["max"][c]),
               c == 0 ? channel["not_finite"].dump() : "");
  if (channel.contains("scale")) fmt::print("  {:<23} times {:g}\n", "", channel["scale"].get<double>());
  if (arity > kShownComponents) fmt::print("  {:<23} and {} more components\n", "", arity - kShownComponents);
}

std::string pointText(const Json& point) {
  return fmt::format("({}, {}, {})", valueText(point[0]), valueText(point[1]), valueText(point[2]));
}

/// What a number stands for, where it is a code.
std::string meaningText(const Json& entry) {
  if (entry["name"] != "CoordSys" || !entry["channel"].get<std::string>().empty()) return "";
  if (!entry["value"].is_array() || entry["value"].empty() || !entry["value"][0].is_number_integer()) return "";
  const std::string axes = axesText(entry["value"][0].get<int>());
  return axes.empty() ? "" : fmt::format(" ({})", axes);
}

std::string metadataText(const Json& entry) {
  if (entry["value"].is_string()) return entry["value"].get<std::string>();
  std::string text;
  for (const Json& value : entry["value"]) text += fmt::format("{}{}", text.empty() ? "" : " ", valueText(value));
  return text;
}

}  // namespace

Json describeParticles(const std::string& path) {
  const std::unique_ptr<ParticleFile> opened = openParticleFile(path);
  const ParticleFile& file = *opened;
  const Json channels = channelsJson(file);
  std::size_t bytes = 0;
  for (const Channel& channel : file.channels()) bytes += channel.bytes();
  Json info = {{"file", path},
               {"kind", "particles"},
               {"format", file.format()},
               {"count", file.count()},
               {"bytes_per_particle", bytes},
               {"channels", channels},
               {"metadata", metadataJson(file)}};
  const Json* position = channelNamed(channels, "Position");
  if (position && (*position)["arity"] >= 3)
    info["bounds"] = {{"min", Json((*position)["min"].begin(), (*position)["min"].begin() + 3)},
                      {"max", Json((*position)["max"].begin(), (*position)["max"].begin() + 3)}};
  info["radius"] = radiusJson(file, channels);
  return info;
}

void printParticles(const Json& info) {
  const auto count = info["count"].get<std::uint64_t>();
  const auto size = info["bytes_per_particle"].get<std::size_t>();
  fmt::print("{}: {}, {} particles of {} bytes ({})\n", info["file"].get<std::string>(),
             info["format"].get<std::string>(), count, size,
             bytesText(static_cast<double>(count) * static_cast<double>(size)));
  fmt::print("  {:<23} {:<12} {:>14} {:>14} {:>14} {:>12}\n", "channel", "type", "min", "mean", "max", "not finite");
  for (const Json& channel : info["channels"]) printChannel(channel);
  if (info.contains("bounds"))
    fmt::print("  {:<23} {} to {}\n", "bounds", pointText(info["bounds"]["min"]), pointText(info["bounds"]["max"]));
  const Json& radius = info["radius"];
  fmt::print("  {:<23} {}\n", "radius", radius["from"].get<std::string>());
  if (radius.contains("mean"))
    fmt::print("  {:<23} {}\n", "",
               radius["min"] == radius["max"] ? valueText(radius["min"])
                                              : fmt::format("{} to {}, mean {}", valueText(radius["min"]),
                                                            valueText(radius["max"]), valueText(radius["mean"])));
  for (const Json& entry : info["metadata"]) {
    const auto channel = entry["channel"].get<std::string>();
    fmt::print("  {:<23} {}\n",
               fmt::format("{}{}{}", channel, channel.empty() ? "" : ".", entry["name"].get<std::string>()),
               metadataText(entry) + meaningText(entry));
  }
}

}  // namespace mote
