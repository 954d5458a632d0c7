// "medium": what the particles are made of.
#include "host/scene/scene_parts.h"

namespace mote {
namespace {

void readPhase(ObjectReader& medium, Phase& phase) {
  ObjectReader object = medium.object("phase", "the phase function");
  object.choice<PhaseType>("type", phase.type,
                           {{"isotropic", PhaseType::Isotropic},
                            {"henyey_greenstein", PhaseType::HenyeyGreenstein},
                            {"rayleigh", PhaseType::Rayleigh}});
  object.number("g", phase.g, {.min = -1, .max = 1, .minOpen = true, .maxOpen = true});
  const bool hasMean = phase.type == PhaseType::HenyeyGreenstein;
  object.onlyWhere(hasMean, "g", R"("g" only in the phase function "henyey_greenstein")");
  if (hasMean && !object.has("g"))
    object.problem("", R"("g", the mean cosine, beside "henyey_greenstein")", "none", "0 scatters to all sides alike");
  object.finish();
}

}  // namespace

void readMedium(ObjectReader& root, Medium& medium) {
  ObjectReader object = root.object("medium", "the medium");
  object.choice<DensityMode>("density_mode", medium.densityMode,
                             {{"cross_section", DensityMode::CrossSection}, {"peak", DensityMode::Peak}});
  object.number("density_scale", medium.densityScale, atLeast(0));
  float opticalDepth = 4;
  const bool calibrated = object.number("optical_depth", opticalDepth, above(0));
  if (calibrated || !object.has("density_scale")) medium.opticalDepth = opticalDepth;
  object.choice<Falloff>("falloff", medium.falloff,
                         {{"smooth", Falloff::Smooth}, {"linear", Falloff::Linear}, {"sphere", Falloff::Sphere}});
  object.vector("albedo", medium.albedo, kShare);
  object.vector("extinction", medium.extinction, atLeast(0));
  readPhase(object, medium.phase);
  object.number("emission_scale", medium.emissionScale, atLeast(0));
  if (object.has("density_scale") && object.has("optical_depth"))
    object.problem("optical_depth", R"(either "density_scale" or "optical_depth")", "both",
                   "optical_depth chooses the scale itself");
  object.finish();
}

}  // namespace mote
