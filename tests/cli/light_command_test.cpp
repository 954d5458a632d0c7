// `mote light` checked as anybody could check it: from the particles in its own output, by the definition.
#include <cmath>

#include "host/particles/formats/prt_reader.h"
#include "tests/cli/mote_program.h"
#include "tests/support/lighting_oracle.h"

namespace mote::test {
namespace {

struct LitFile {
  std::vector<vec3> position, lighting;
  std::vector<float> radius, density, lamp, sun;
  std::vector<std::uint64_t> id;
};

LitFile readLit(const std::string& path) {
  LitFile lit;
  const PrtReader reader(path);
  const std::vector<ChannelRequest> requests{{"Position", &lit.position},
                                             {"Lighting", &lit.lighting},
                                             {"Radius", &lit.radius},
                                             {"Density", &lit.density},
                                             {"ID", &lit.id},
                                             {"Transmittance_lamp", &lit.lamp},
                                             {"Transmittance_sun", &lit.sun}};
  reader.read(requests);
  return lit;
}

/// The definition, particle by particle, for `smooth` and `soft`.
double transmittance(const LitFile& lit, std::size_t i, const dvec3& direction, double length, double shadowDensity) {
  double depth = 0;
  for (std::size_t j = 0; j < lit.position.size(); ++j) {
    if (j == i) continue;
    const double peak = lit.density[j] * 3 / (kPi * lit.radius[j] * lit.radius[j]);
    depth += peak * oracleShare(dvec3(lit.position[j]) - dvec3(lit.position[i]), direction, length, lit.radius[j],
                                layout::kFalloffSmooth, layout::kEndpointSoft);
  }
  return std::exp(-shadowDensity * depth);
}

TEST(LightCommand, WritesWhatTheDefinitionGivesForEveryParticle) {
  const TempFolder folder;
  makeBall(folder);
  writeBytes(folder.file("scene.json"), R"({
    "particles": [{"file": "ball.prt"}],
    "medium": {"density_scale": 1},
    "lighting": {"cutoff": 0},
    "lights": [
      {"name": "lamp", "type": "point", "position": [1.5, 2, -0.5], "color": [1, 0.5, 0.25], "intensity": 20},
      {"name": "sun", "type": "directional", "direction": [0, -2, 0], "irradiance": 3, "shadow_density": 0.5}
    ]})");
  const ProcessResult result =
      mote({"light", folder.file("scene.json"), "-o", folder.file("lit.prt"), "--lighting", "cpu"});
  ASSERT_EQ(result.exitCode, 0) << result.err;

  const LitFile lit = readLit(folder.file("lit.prt"));
  ASSERT_EQ(lit.position.size(), 2000u);
  const dvec3 lamp(1.5, 2, -0.5);
  for (std::size_t i = 0; i < 2000; ++i) {
    EXPECT_EQ(lit.id[i], i) << "particles stay in the order of the input";
    const dvec3 toLamp = lamp - dvec3(lit.position[i]);
    const double distance = glm::length(toLamp);
    const double a = transmittance(lit, i, toLamp / distance, distance, 1);
    const double b = transmittance(lit, i, {0, 1, 0}, INFINITY, 0.5);
    // 1e-4 of the optical depth, at most 1/e of that in T; and the rounding of float.
    ASSERT_NEAR(lit.lamp[i], a, 4e-5) << i;
    ASSERT_NEAR(lit.sun[i], b, 4e-5) << i;
    const dvec3 expected = (20 / (distance * distance) * a * dvec3(1, 0.5, 0.25) + 3 * b * dvec3(1)) / (4 * kPi);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(lit.lighting[i][c], expected[c], 1e-4 * (1 + expected[c]));
  }
}

TEST(LightCommand, NeedsNoSprite) {
  const TempFolder folder;
  makeBall(folder);
  writeBytes(folder.file("scene.json"),
             R"({"particles": [{"file": "ball.prt"}], "view": {"sprite_color": "gone.png"}})");
  const ProcessResult result =
      mote({"light", folder.file("scene.json"), "-o", folder.file("lit.prt"), "--lighting", "cpu"});
  EXPECT_EQ(result.exitCode, 0) << result.err;
}

}  // namespace
}  // namespace mote::test
