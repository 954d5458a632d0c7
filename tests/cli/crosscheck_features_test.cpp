// CPU against compute, feature by feature: every key of a scene that changes light or picture, small and validated.
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/core/random.h"
#include "host/image/png.h"
#include "host/particles/generate.h"
#include "host/particles/prt_writer.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

/// One feature: what `--set` changes in the scene below.
struct Feature {
  const char* name;
  std::vector<std::string> settings;
};

std::ostream& operator<<(std::ostream& out, const Feature& feature) { return out << feature.name; }

/// 20,000 particles of a ball with every channel, a spot and a sun, and all layers.
constexpr const char* kScene = R"({
  "particles": [{"file": "ball.prt"}],
  "medium": {"optical_depth": 3},
  "lights": [
    {"name": "rim", "type": "spot", "position": [-3, 3, -1], "target": [0, 0, 0], "intensity": 200, "inner_angle": 8, "outer_angle": 16},
    {"name": "sun", "type": "directional", "direction": [0.3, -1, -0.4], "irradiance": 3}
  ],
  "lighting": {"cutoff": 0},
  "camera": {"position": [1, 1.5, 4.5], "target": [0, 0, 0], "fov": 35, "near": 0.1, "far": 50},
  "output": {"size": [160, 90], "aovs": ["Z", "lights", "velocity", "optical_depth", "shadow"]}
})";

constexpr const char* kSolids =
    R"(/solids=[{"name": "block", "file": "block.obj", "translate": [0.4, 0.9, 0.6], "rotate": [20, 30, 0], "scale": 0.4},
                {"name": "ground", "file": "ground.obj", "translate": [0, -1, 0], "albedo": [0.2, 0.5, 0.8]}])";

/// A cube of edge 2 about the origin, and a square of edge 8 in y = 0.
constexpr const char* kBlock = R"(v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
f 1 4 3 2
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
)";
constexpr const char* kGround = "v -4 0 -4\nv 4 0 -4\nv 4 0 4\nv -4 0 4\nf 1 4 3 2\n";

/// The ball with colours, absorption, emission and a spin that differ from particle to particle.
void writeBall(const std::string& path, bool everyChannel) {
  ParticleSet set = generateBall(20000, 5);
  std::vector<vec3> absorption, emission;
  for (std::size_t i = 0; i < set.size(); ++i) {
    Random random(11, i);
    const auto share = [&] { return static_cast<float>(random.uniform()); };
    set.color.emplace_back(share(), share(), share());
    absorption.emplace_back(share(), 0.5f * share(), 0.1f * share());
    emission.push_back(i % 50 == 0 ? vec3(2, 0.6f, 0.1f) : vec3(0));
    set.velocity.emplace_back(8 * set.position[i].z, 1.0f, -8 * set.position[i].x);
  }
  std::vector<PrtColumn> columns = columnsOf(set);
  if (everyChannel) {
    columns.push_back(PrtColumn::of("Absorption", std::span<const vec3>(absorption)));
    columns.push_back(PrtColumn::of("Emission", std::span<const vec3>(emission)));
  }
  writePrt(path, columns);
}

class CrosscheckFeature : public testing::TestWithParam<Feature> {};

TEST_P(CrosscheckFeature, HostAndDeviceAgree) {
  const TempFolder folder;
  writeBall(folder.file("ball.prt"), false);
  writeBall(folder.file("every.prt"), true);
  writeBytes(folder.file("block.obj"), kBlock);
  writeBytes(folder.file("ground.obj"), kGround);
  // A sprite of 2 × 2 pixels: red, green; blue, black.
  writePngBytes(folder.file("sprite.png"), {255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, 2, 2);
  writeBytes(folder.file("scene.json"), kScene);
  const std::string report = folder.file("report.json");
  std::vector<std::string> arguments{"crosscheck", folder.file("scene.json"), "--validate", "--report", report};
  for (const std::string& setting : GetParam().settings) arguments.insert(arguments.end(), {"--set", setting});
  const ProcessResult result = mote(arguments, kOnLavapipe);
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;

  std::ifstream file(report);
  const nlohmann::json found = nlohmann::json::parse(file);
  double worst = 0;
  for (const auto& light : found["lights"]) {
    worst = std::max(worst, light["worst_delta_transmittance"].get<double>());
    // A feature that leaves every particle dark, or in full light, would agree with anything.
    EXPECT_GT(light["mean_transmittance"].get<double>(), 0.001) << light;
    EXPECT_LT(light["mean_transmittance"].get<double>(), 0.999) << light;
  }
  EXPECT_GT(found["picture"]["mean_alpha"].get<double>(), 0.01);
  double layers = 0;
  for (const auto& [name, channel] : found["picture"]["channels"].items())
    layers = std::max(layers, channel["rmse"].get<double>());
  std::printf("%-28s |dT| %.1e  picture RMSE %.1e, worst layer %.1e\n", GetParam().name, worst,
              found["picture"]["rmse"].get<double>(), layers);
}

const Feature kFeatures[] = {
    {"SpotAndSun", {}},
    {"PointLight", {R"(/lights/0={"name": "key", "position": [2, 2, 2], "intensity": 60, "decay": 1})"}},
    {"PointLightInside", {R"(/lights/0={"name": "key", "position": [0.1, 0.2, 0], "intensity": 1})"}},
    {"ShadowDensity", {"/lights/0/shadow_density=0.3", "/lights/1/shadow_density=2.5"}},
    {"ClampedEnds", {R"(/lighting/endpoint="clamp")"}},
    {"LinearFalloff", {R"(/medium/falloff="linear")"}},
    {"SphereFalloff", {R"(/medium/falloff="sphere")"}},
    {"PeakDensity", {R"(/medium/density_mode="peak")", "/lighting/radius_scale=2", "/view/radius_scale=0.5"}},
    {"HenyeyGreenstein", {R"(/medium/phase={"type": "henyey_greenstein", "g": 0.7})"}},
    {"Rayleigh", {R"(/medium/phase={"type": "rayleigh"})"}},
    {"UniformRgbExtinction", {"/medium/extinction=[0.3, 1, 2]"}},
    {"AbsorptionAndEmission", {R"(/particles/0/file="every.prt")", "/medium/emission_scale=0.5"}},
    {"RadiusScales", {"/lighting/radius_scale=1.7", "/view/radius_scale=0.6"}},
    {"Subsample", {"/lighting/subsample=0.2", "/lighting/subsample_seed=4"}},
    {"SubsampleUncompensated", {"/lighting/subsample=0.5", "/lighting/compensate=false"}},
    {"AutoSubsample", {R"(/lighting/subsample="auto")", "/lighting/error=0.02"}},
    {"CoarseCells", {"/lighting/particles_per_cell=500"}},
    {"Solids", {kSolids}},
    {"SolidsHoldOut", {kSolids, R"(/solids/0/mode="holdout")", R"(/solids/1/mode="holdout")"}},
    {"SolidsHidden", {kSolids, R"(/solids/0/mode="hidden")"}},
    {"SoftSolidShadows", {kSolids, "/lighting/solid_shadow_intensity=0.6", "/solids/1/receives_shadows=false"}},
    {"Orthographic",
     {R"(/camera={"type": "orthographic", "position": [1, 1, 4], "target": [0, 0, 0], "height": 2.6})"}},
    {"PixelAspect", {"/output/pixel_aspect=2"}},
    {"NearAndFar", {"/camera/near=4.2", "/camera/far=5"}},
    {"MotionBlur", {"/camera/shutter=[-0.02, 0.02]"}},
    {"CameraMotion",
     {"/camera/shutter=[0, 0.04]",
      R"(/camera/keys=[{"frame": 0, "position": [0, 1.5, 4.5]}, {"frame": 2, "position": [2, 1.5, 4.5]}])"}},
    {"DepthOfField", {"/camera/aperture_radius=0.15", "/camera/focus_distance=4"}},
    {"DepthOfFieldInMotion",
     {"/camera/aperture_radius=0.15", "/camera/focus_distance=4", "/camera/shutter=[-0.02, 0.02]"}},
    {"Sprites", {R"(/view/sprite_color="sprite.png")", R"(/view/sprite_opacity="sprite.png")"}},
    {"Everything",
     {kSolids, R"(/particles/0/file="every.prt")", "/medium/extinction=[0.5, 1, 1.5]", "/lighting/subsample=0.5",
      R"(/medium/phase={"type": "henyey_greenstein", "g": -0.3})", "/camera/shutter=[-0.01, 0.01]",
      "/camera/aperture_radius=0.05", R"(/view/sprite_color="sprite.png")", "/output/pixel_aspect=1.5"}},
};

INSTANTIATE_TEST_SUITE_P(Scenes, CrosscheckFeature, testing::ValuesIn(kFeatures),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace mote::test
