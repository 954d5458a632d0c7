// "lighting": how the light at each particle is computed, and what may be approximated.
#include "host/scene/scene_parts.h"

namespace mote {
namespace {

bool isAuto(const JsonNode& node) { return node.kind == JsonNode::Kind::String && node.text == "auto"; }

void readParticlesPerCell(ObjectReader& object, std::uint32_t& particlesPerCell) {
  const JsonNode* node = object.find("particles_per_cell");
  if (node && node->kind == JsonNode::Kind::Number) {
    object.integer<std::uint32_t>("particles_per_cell", particlesPerCell, 1, 1'000'000);
  } else if (node && !isAuto(*node)) {
    object.problem("particles_per_cell", R"(a whole number from 1 to 1000000 or "auto")", node->shown());
  }
}

void readSubsample(ObjectReader& object, LightingSettings& lighting) {
  const JsonNode* node = object.find("subsample");
  if (node && node->kind == JsonNode::Kind::Number) {
    object.number("subsample", lighting.subsample, {.min = 0, .max = 1, .minOpen = true});
  } else if (node && !isAuto(*node)) {
    object.problem("subsample", R"(a share > 0 and <= 1 or "auto")", node->shown());
  }
  lighting.autoSubsample = node && isAuto(*node);
  if (lighting.autoSubsample && lighting.error == 0)
    object.problem("subsample", R"("auto" only beside an "error" > 0)", R"("auto" with an error of 0)",
                   "it is the smallest share whose mean |ΔT| is within the error; for example \"error\": 0.01");
}

}  // namespace

void readLighting(ObjectReader& root, LightingSettings& lighting) {
  ObjectReader object = root.object("lighting", "the lighting settings");
  readBackend(object, lighting.backend);
  object.number("cutoff", lighting.cutoff, {.min = 0, .max = 1, .maxOpen = true});
  object.choice<Endpoint>("endpoint", lighting.endpoint, {{"soft", Endpoint::Soft}, {"clamp", Endpoint::Clamp}});
  object.number("radius_scale", lighting.radiusScale, above(0));
  readParticlesPerCell(object, lighting.particlesPerCell);
  object.number("error", lighting.error, {.min = 0, .max = 1, .maxOpen = true});
  readSubsample(object, lighting);
  object.integer<std::uint64_t>("subsample_seed", lighting.subsampleSeed, 0, std::numeric_limits<std::uint64_t>::max());
  object.boolean("compensate", lighting.compensate);
  object.number("solid_shadow_intensity", lighting.solidShadowIntensity, kShare);
  object.finish();
}

}  // namespace mote
