// "particles": files and generators, with the channels, radii and places of their particles.
#include <fmt/format.h>

#include <limits>

#include "host/scene/scene_parts.h"

namespace mote {
namespace {

constexpr Range kUnit{.min = 0, .max = kMaxLength, .minOpen = true, .unit = "m"};

void readRadius(ObjectReader& source, RadiusRule& rule) {
  const JsonNode* node = source.find("radius");
  ObjectReader byChannel = source.objectIfAny("radius", "a radius rule");
  byChannel.text("channel", rule.channel);
  byChannel.number("scale", rule.scale, above(0));
  byChannel.finish();
  if (!node) return;
  if (node->kind == JsonNode::Kind::Object) {
    rule.kind = RadiusRule::Kind::Channel;
  } else if (node->kind == JsonNode::Kind::Number) {
    rule.kind = RadiusRule::Kind::Number;
    source.number("radius", rule.value, kLength);
  } else if (node->kind != JsonNode::Kind::String || node->text != "auto") {
    source.problem("radius", R"(a number > 0, {"channel":…, "scale":…} or "auto")", node->shown());
  }
}

void readUnit(ObjectReader& source, std::optional<LengthUnit>& unit) {
  const JsonNode* node = source.find("unit");
  if (!node) return;
  float metres = 1;
  if (node->kind == JsonNode::Kind::String && node->text == "file") {
    unit = LengthUnit{.fromFile = true};
  } else if (node->kind != JsonNode::Kind::Number) {
    source.problem("unit", R"(the metres that a unit of the file is long, > 0, or "file")", node->shown());
  } else if (source.number("unit", metres, kUnit)) {
    unit = LengthUnit{.metres = node->number};
  }
}

void readMeaning(ObjectReader& source, ParticleSource& particles) {
  UpAxis up = UpAxis::Y;
  if (source.choice<UpAxis>("up", up, {{"y", UpAxis::Y}, {"z", UpAxis::Z}, {"file", UpAxis::File}})) particles.up = up;
  readUnit(source, particles.unit);
  source.choice<VelocityTime>("velocity_per", particles.velocityPer,
                              {{"second", VelocityTime::Second}, {"frame", VelocityTime::Frame}});
  source.choice<Interpolation>("interpolate", particles.interpolate,
                               {{"velocity", Interpolation::Velocity}, {"hermite", Interpolation::Hermite}});
}

void readChannels(ObjectReader& source, std::map<std::string, std::string>& channels) {
  ObjectReader object = source.object("channels", "the channel names");
  for (const char* ours : {"Position", "Radius", "Density", "Color", "Absorption", "Emission", "Velocity", "ID"}) {
    std::string theirs;
    if (object.text(ours, theirs)) channels[ours] = theirs;
  }
  object.finish();
}

ParticleSource readParticleSource(ObjectReader& object, const std::filesystem::path& folder) {
  ParticleSource source;
  source.pointer = object.pointer();
  const bool fromFile = object.has("file"), generated = object.has("generate");
  readPath(object, "file", source.file, folder);
  object.choice<Generator>("generate", source.generate,
                           {{"ball", Generator::Ball}, {"cloud", Generator::Cloud}, {"plume", Generator::Plume}});
  object.integer<std::uint64_t>("count", source.count, 1, 4'000'000'000, "particles");
  object.integer<std::uint64_t>("seed", source.seed, 0, std::numeric_limits<std::uint64_t>::max());
  object.text("grid", source.grid);
  readRadius(object, source.radius);
  readChannels(object, source.channels);
  readMeaning(object, source);
  object.number("density", source.density, atLeast(0));
  object.vector("color", source.color, kShare);
  object.vector("translate", source.translate, kCoordinate);
  object.vector("rotate", source.rotate, kDegrees);
  object.number("scale", source.scale, above(0));

  if (fromFile && generated) {
    object.problem("generate", R"(either "file" or "generate")", "both");
  } else if (!fromFile && !generated) {
    object.problem("", R"("file" or "generate")", "neither");
  } else if (generated && !object.has("count")) {
    object.problem("", R"("count" beside "generate")", "none");
  }
  for (const char* key : {"grid", "channels", "up", "unit", "velocity_per", "interpolate"})
    object.onlyWhere(!generated || fromFile, key, fmt::format("\"{}\" only beside \"file\"", key));
  object.finish();
  return source;
}

}  // namespace

void readParticles(ObjectReader& root, Scene& scene) {
  const std::filesystem::path folder = folderOf(scene);
  std::vector<ObjectReader> sources = root.list("particles", "a particle source");
  for (ObjectReader& source : sources) scene.particles.push_back(readParticleSource(source, folder));
  constexpr std::string_view kExpected = R"("particles" with at least one source)";
  if (!root.has("particles")) {
    root.problem("", kExpected, "none", R"(for example "particles": [{"file": "x.prt"}])");
  } else if (sources.empty()) {
    root.problem("particles", kExpected, "none");
  }
}

}  // namespace mote
