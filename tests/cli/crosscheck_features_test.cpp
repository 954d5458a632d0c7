// CPU against compute, feature by feature: every key of a scene that changes light or picture, small and validated.
// Each key is also taken away again: a picture that stays the same would mean that nobody looks at it.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/core/random.h"
#include "host/image/compare.h"
#include "host/image/exr.h"
#include "host/image/png.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/generate.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Settings = std::vector<std::string>;

/// Far more than any two ways to add the same numbers give, far less than any feature here is worth: of R G B A, or of
/// a layer in units of its scale.
constexpr double kLeastChange = 1e-3;

/// One feature: what `--set` changes in the scene below.
struct Feature {
  const char* name;
  Settings settings;       ///< each of these changes the picture or a layer by itself
  Settings common{};       ///< what has to be there for that
  int mostNodes = 100000;  ///< of the octree
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

constexpr const char* kKeys =
    R"(/camera/keys=[{"frame": 0, "position": [0, 1.5, 4.5]}, {"frame": 2, "position": [2, 1.5, 4.5]}])";

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

/// How far apart two pictures are: the greatest RMSE of R G B A and of the layers that both have, these by their scale.
double change(const Image& a, const Image& b) {
  const ImageDifference d = compareImages(a, b);
  double greatest = d.overall.rmse;
  for (const LayerDifference& layer : d.layers)
    greatest =
        std::max({greatest, layer.channel.rmse / layer.scale, double(layer.unmatched) / double(a.pixels.size())});
  return greatest;
}

class CrosscheckFeature : public testing::TestWithParam<Feature> {
 protected:
  CrosscheckFeature() {
    writeBall(folder_.file("ball.prt"), false);
    writeBall(folder_.file("every.prt"), true);
    writeBytes(folder_.file("block.obj"), kBlock);
    writeBytes(folder_.file("ground.obj"), kGround);
    // A sprite of 2 × 2 pixels: red, green; blue, black.
    writePngBytes(folder_.file("sprite.png"), {255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, 2, 2);
    Image sprite(3, 1);
    sprite.pixels = {vec4(2, 1, 0.5f, 0.25f), vec4(0.5f, 1, 2, 1), vec4(1, 0, 1, 0.5f)};
    writeExr(folder_.file("sprite.exr"), sprite, {.precision = ExrPrecision::Float});
    writeBytes(folder_.file("scene.json"), kScene);
  }

  /// The scene with these settings, on the host.
  Image render(const Settings& settings) const {
    const std::string path = folder_.file("picture.exr");
    Settings arguments{"render", folder_.file("scene.json"), "--lighting", "cpu", "--raster", "cpu", "-o", path,
                       "--set",  "/output/precision=float"};
    for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
    const ProcessResult result = mote(arguments, kWithoutVulkan);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return readExr(path);
  }

  /// Renders with all settings and without each in turn: every one must make a difference.
  double leastChange() const {
    const Feature& feature = GetParam();
    Settings all = feature.common;
    all.insert(all.end(), feature.settings.begin(), feature.settings.end());
    const Image image = render(all);
    double least = 1;
    for (std::size_t k = 0; k < feature.settings.size(); ++k) {
      Settings others = all;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(feature.common.size() + k));
      const double found = change(image, render(others));
      EXPECT_GT(found, kLeastChange) << feature.settings[k] << " changes nothing";
      least = std::min(least, found);
    }
    return least;
  }

  const TempFolder folder_;
};

TEST_P(CrosscheckFeature, HostAndDeviceAgreeAndTheFeatureShows) {
  const Feature& feature = GetParam();
  const std::string report = folder_.file("report.json");
  Settings arguments{"crosscheck", folder_.file("scene.json"), "--validate", "--report", report};
  for (const Settings* settings : {&feature.common, &feature.settings})
    for (const std::string& setting : *settings) arguments.insert(arguments.end(), {"--set", setting});
  const ProcessResult result = mote(arguments, kOnLavapipe);
  ASSERT_EQ(result.exitCode, 0) << result.out << result.err;

  std::ifstream file(report);
  const nlohmann::json found = nlohmann::json::parse(file);
  EXPECT_EQ(found["passed"], true);
  EXPECT_TRUE(found["failures"].empty());
  double worst = 0;
  int index = 0;
  for (const auto& light : found["lights"]) {
    worst = std::max(worst, light["worst_delta_transmittance"].get<double>());
    const std::string off = fmt::format("/lights/{}/casts_shadows=false", index++);
    if (std::find(feature.settings.begin(), feature.settings.end(), off) != feature.settings.end()) {
      EXPECT_EQ(light["mean_transmittance"], 1) << light;
      continue;
    }
    // A feature that leaves every particle dark, or in full light, would agree with anything.
    EXPECT_GT(light["mean_transmittance"].get<double>(), 0.001) << light;
    EXPECT_LT(light["mean_transmittance"].get<double>(), 0.999) << light;
  }
  EXPECT_GT(found["picture"]["mean_alpha"].get<double>(), 0.01);
  EXPECT_LT(found["octree_nodes"].get<int>(), feature.mostNodes);

  // All layers of the scene, each of them judged and none of them empty.
  std::string layers, worstLayer;
  double worstOfLayers = -1;
  for (const auto& layer : found["layers"]) {
    const std::string name = layer["layer"].get<std::string>();
    layers += " " + name;
    EXPECT_EQ(layer["passed"], true) << layer;
    EXPECT_EQ(layer["not_finite"], 0) << layer;
    EXPECT_GE(layer["within"].get<double>(), 0.999) << layer;
    EXPECT_GT(layer["level"].get<double>(), 0) << layer;
    const double own = layer["rmse"].get<double>() / layer["scale"].get<double>();
    if (own > worstOfLayers) worstOfLayers = own, worstLayer = name;
  }
  for (const char* name : {" Z", " optical_depth", " velocity", " shadow.sun", " light.sun"})
    EXPECT_TRUE(contains(layers, name));

  std::printf("%-28s |dT| %.1e  picture RMSE %.1e, worst layer %.1e (%s), least change %.1e\n", feature.name, worst,
              found["picture"]["rmse"].get<double>(), worstOfLayers, worstLayer.c_str(), leastChange());
}

constexpr const char* kAlbedo = R"(/solids/1/albedo=[0.9, 0.1, 0.1])";

const Feature kFeatures[] = {
    {"SpotAndSun", {}},
    {"PointLight", {R"(/lights/0={"name": "rim", "position": [2, 2, 2], "intensity": 60})", "/lights/0/decay=1"}},
    {"PointLightInside", {R"(/lights/0={"name": "rim", "position": [0.1, 0.2, 0], "intensity": 1})"}},
    {"ShadowDensity", {"/lights/0/shadow_density=0.3", "/lights/1/shadow_density=2.5"}},
    {"LightWithoutShadows", {"/lights/0/casts_shadows=false"}},
    {"SunWithoutShadowsAmongSolids", {"/lights/1/casts_shadows=false"}, {kSolids}},
    {"ClampedEnds", {R"(/lighting/endpoint="clamp")"}},
    {"LinearFalloff", {R"(/medium/falloff="linear")"}},
    {"SphereFalloff", {R"(/medium/falloff="sphere")"}},
    {"PeakDensity", {R"(/medium/density_mode="peak")"}, {"/lighting/radius_scale=2", "/view/radius_scale=0.5"}},
    {"HenyeyGreenstein", {R"(/medium/phase={"type": "henyey_greenstein", "g": 0.7})"}},
    {"Rayleigh", {R"(/medium/phase={"type": "rayleigh"})"}},
    {"UniformRgbExtinction", {"/medium/extinction=[0.3, 1, 2]"}},
    {"AbsorptionAndEmission", {R"(/particles/0/file="every.prt")", "/medium/emission_scale=0.5"}},
    {"RadiusScales", {"/lighting/radius_scale=1.7", "/view/radius_scale=0.6"}},
    {"Subsample", {"/lighting/subsample=0.2", "/lighting/subsample_seed=4"}},
    {"SubsampleUncompensated", {"/lighting/subsample=0.5", "/lighting/compensate=false"}},
    {"AutoSubsample", {R"(/lighting/subsample="auto")"}, {"/lighting/error=0.05"}},
    // Larger cells change no number; 20,000 particles in cells of 500 need few nodes, in the usual ones 1,000 at least.
    {"CoarseCells", {}, {"/lighting/particles_per_cell=500"}, 400},
    {"Solids", {kSolids}},
    {"SolidsAlbedo", {kAlbedo}, {kSolids}},
    {"SolidsHoldOut", {R"(/solids/0/mode="holdout")", R"(/solids/1/mode="holdout")"}, {kSolids}},
    {"SolidsHidden", {R"(/solids/0/mode="hidden")"}, {kSolids}},
    {"SolidsWithoutShadows", {"/solids/0/casts_shadows=false"}, {kSolids}},
    {"SoftSolidShadows", {"/lighting/solid_shadow_intensity=0.6", "/solids/1/receives_shadows=false"}, {kSolids}},
    {"Orthographic",
     {R"(/camera={"type": "orthographic", "position": [1, 1, 4], "target": [0, 0, 0], "height": 2.6})"}},
    {"OrthographicSolids",
     {R"(/camera={"type": "orthographic", "position": [1, 1, 4], "target": [0, 0, 0], "height": 2.6})"},
     {kSolids}},
    {"PixelAspect", {"/output/pixel_aspect=2"}},
    {"NearAndFar", {"/camera/near=4.2", "/camera/far=5"}},
    {"MotionBlur", {"/camera/shutter=[-0.02, 0.02]"}},
    {"CameraMotion", {"/camera/shutter=[0, 0.04]", kKeys}},
    {"CameraMotionAmongSolids", {"/camera/shutter=[0, 0.04]", kKeys}, {kSolids}},
    {"DepthOfField", {"/camera/aperture_radius=0.15", "/camera/focus_distance=4"}},
    {"DepthOfFieldInMotion",
     {"/camera/shutter=[-0.02, 0.02]"},
     {"/camera/aperture_radius=0.15", "/camera/focus_distance=4"}},
    {"Sprites", {R"(/view/sprite_color="sprite.png")", R"(/view/sprite_opacity="sprite.png")"}},
    {"ExrSprites", {R"(/view/sprite_color="sprite.exr")", R"(/view/sprite_opacity="sprite.exr")"}},
    {"Everything",
     {"/medium/extinction=[0.5, 1, 1.5]", "/lighting/subsample=0.5"},
     {kSolids, R"(/particles/0/file="every.prt")", R"(/medium/phase={"type": "henyey_greenstein", "g": -0.3})",
      "/camera/shutter=[-0.01, 0.01]", "/camera/aperture_radius=0.05", R"(/view/sprite_color="sprite.png")",
      "/output/pixel_aspect=1.5"}},
};

/// A layer alone decides: the picture has no velocity in it, so that all else is as alike as ever.
TEST(CrosscheckVerdict, ALayerThatIsNotFiniteFailsWhateverThePictureIs) {
  const TempFolder folder;
  const std::vector<vec3> position{{-0.3f, 0, 0}, {0.3f, 0, 0}}, velocity{{0, 0, 0}, {3e38f, 0, 0}};
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(position)),
                                       PrtColumn::of("Velocity", std::span<const vec3>(velocity))};
  writePrt(folder.file("two.prt"), columns);
  writeBytes(folder.file("scene.json"), R"({"particles": [{"file": "two.prt", "radius": 0.5}],
    "camera": {"position": [0, 0, 4], "target": [0, 0, 0], "fov": 0.5}, "output": {"size": [64, 48], "aovs": ["Z", "velocity"]}})");
  const std::string report = folder.file("report.json");
  const auto crosscheck = [&](const Settings& more) {
    Settings arguments{"crosscheck", folder.file("scene.json"), "--report", report};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return mote(arguments, kOnLavapipe);
  };
  const ProcessResult result = crosscheck({});
  EXPECT_EQ(result.exitCode, 1) << result.out << result.err;
  EXPECT_TRUE(contains(result.out, "layer Z: "));
  EXPECT_TRUE(contains(result.out, "differs: velocity.x: "));
  std::ifstream file(report);
  const nlohmann::json found = nlohmann::json::parse(file);
  EXPECT_EQ(found["passed"], false);
  EXPECT_EQ(found["picture"]["within"], 1);
  for (const auto& layer : found["layers"]) EXPECT_EQ(layer["passed"], layer["layer"] == "Z") << layer;
  EXPECT_EQ(crosscheck({"--set", R"(/output/aovs=["Z"])"}).exitCode, 0);
}

INSTANTIATE_TEST_SUITE_P(Scenes, CrosscheckFeature, testing::ValuesIn(kFeatures),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace mote::test
