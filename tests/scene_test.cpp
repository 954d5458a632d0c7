// The scene parser: what it reads, and what --set changes.
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/scene_text.h"

namespace mote {
namespace {

using namespace test;

TEST(SceneReader, FillsInEveryDefaultOfTheContract) {
  const Scene scene = parseScene(kLeast, "folder/s.json");
  ASSERT_EQ(scene.particles.size(), 1u);
  EXPECT_EQ(scene.particles[0].file, "folder/x.prt");
  EXPECT_EQ(scene.particles[0].pointer, "/particles/0");
  EXPECT_EQ(scene.particles[0].radius.kind, RadiusRule::Kind::Auto);
  EXPECT_EQ(scene.medium.opticalDepth, 4.0f);
  EXPECT_EQ(scene.medium.albedo, vec3(0.95f));
  EXPECT_TRUE(scene.defaultLights);
  EXPECT_TRUE(scene.lights.empty());
  EXPECT_TRUE(scene.camera.fitted);
  EXPECT_TRUE(scene.camera.fittedDepths);
  EXPECT_EQ(scene.lighting, LightingSettings{});
  EXPECT_EQ(scene.lighting.cutoff, 1e-4f);
  EXPECT_EQ(scene.medium.extinction, vec3(1));
  EXPECT_EQ(scene.medium.phase, Phase{});
  EXPECT_TRUE(scene.solids.empty());
  EXPECT_EQ(scene.view, View{});
  EXPECT_EQ(scene.output.size, ivec2(1280, 720));
  EXPECT_EQ(scene.output.file, "folder/mote.####.exr");
  EXPECT_EQ(scene.frames, Frames{});
}

TEST(SceneReader, ReadsEveryKey) {
  const Scene scene = parseScene(R"({
    "mote": 1,
    "particles": [
      {"file": "/data/p.####.prt", "radius": {"channel": "pscale", "scale": 2}, "channels": {"Density": "rho", "ID": "n", "Absorption": "a", "Emission": "e"},
       "density": 3, "color": [0.1, 0.2, 0.3], "translate": [1, 2, 3], "rotate": [4, 5, 6], "scale": 7},
      {"generate": "cloud", "count": 350000, "seed": 18446744073709551615, "radius": 0.25},
      {"generate": "ball", "count": 1e6, "radius": "auto"}],
    "medium": {"density_mode": "peak", "density_scale": 0.5, "falloff": "sphere", "albedo": [1, 0, 0.5],
               "extinction": [1, 2, 0], "phase": {"type": "henyey_greenstein", "g": -0.5}, "emission_scale": 3},
    "lights": [
      {"name": "key", "type": "point", "position": [2, 3, 1], "color": [2, 1, 0], "intensity": 60, "decay": 1,
       "shadow_density": 0.5, "casts_shadows": false},
      {"type": "directional", "direction": [0, -2, 0], "irradiance": 4},
      {"type": "spot", "position": [1, 2, 3], "target": [1, 2, 8], "intensity": 5, "decay": 0, "inner_angle": 0,
       "outer_angle": 120}],
    "lighting": {"backend": "gpu", "cutoff": 0, "endpoint": "clamp", "radius_scale": 1.5, "particles_per_cell": 16,
                 "subsample": 0.25, "subsample_seed": 18446744073709551615, "compensate": false, "error": 0.125,
                 "solid_shadow_intensity": 0.5},
    "solids": [
      {"name": "ground", "file": "g.####.obj", "mode": "holdout", "albedo": [0, 0.5, 1], "casts_shadows": false,
       "receives_shadows": false, "translate": [1, 2, 3], "rotate": [4, 5, 6], "scale": 7},
      {"file": "/data/m.ply"}],
    "camera": {"type": "perspective", "position": [0, 0, 9], "target": [0, 1, 0], "up": [0, 2, 0], "fov": 20,
               "near": 0.5, "far": 50, "shutter": [-0.5, 0.25], "aperture_radius": 0.125, "focus_distance": 6,
               "keys": [{"frame": -1.5, "position": [1, 2, 3], "target": [4, 5, 6], "up": [0, 1, 1], "fov": 30},
                        {"frame": 7, "focus_distance": 8}]},
    "view": {"backend": "cpu", "radius_scale": 0.5, "sprite_color": "c.png", "sprite_opacity": "/data/o.exr"},
    "output": {"file": "o.exr", "size": [640, 480], "precision": "float", "compression": "piz", "pixel_aspect": 2,
               "aovs": ["velocity", "Z", "lights"]},
    "frames": {"first": -3, "last": 9, "step": 2, "fps": 25}
  })",
                                 "f/s.json");
  ASSERT_EQ(scene.particles.size(), 3u);
  const ParticleSource& file = scene.particles[0];
  EXPECT_EQ(file.file, "/data/p.####.prt");
  EXPECT_EQ(file.radius, (RadiusRule{RadiusRule::Kind::Channel, 0, "pscale", 2}));
  EXPECT_EQ(file.channels, (std::map<std::string, std::string>{
                               {"Absorption", "a"}, {"Density", "rho"}, {"Emission", "e"}, {"ID", "n"}}));
  EXPECT_EQ(file.density, 3);
  EXPECT_EQ(file.color, vec3(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(file.translate, dvec3(1, 2, 3));
  EXPECT_EQ(file.rotate, vec3(4, 5, 6));
  EXPECT_EQ(file.scale, 7);
  EXPECT_EQ(scene.particles[1].generate, Generator::Cloud);
  EXPECT_EQ(scene.particles[1].count, 350000u);
  EXPECT_EQ(scene.particles[1].seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(scene.particles[1].radius, (RadiusRule{RadiusRule::Kind::Number, 0.25f, "Radius", 1}));
  EXPECT_EQ(scene.particles[2].count, 1000000u);
  EXPECT_EQ(scene.medium, (Medium{.densityMode = DensityMode::Peak,
                                  .densityScale = 0.5f,
                                  .opticalDepth = std::nullopt,
                                  .falloff = Falloff::Sphere,
                                  .albedo = {1, 0, 0.5f},
                                  .extinction = {1, 2, 0},
                                  .phase = {PhaseType::HenyeyGreenstein, -0.5f},
                                  .emissionScale = 3}));
  ASSERT_EQ(scene.lights.size(), 3u);
  EXPECT_EQ(scene.lights[0], (LightSource{.name = "key",
                                          .type = LightType::Point,
                                          .position = {2, 3, 1},
                                          .color = {2, 1, 0},
                                          .strength = 60,
                                          .decay = 1,
                                          .shadowDensity = 0.5f,
                                          .castsShadows = false}));
  EXPECT_EQ(scene.lights[1].name, "light1");
  EXPECT_EQ(scene.lights[1].direction, vec3(0, -1, 0));
  EXPECT_EQ(scene.lights[1].strength, 4);
  EXPECT_EQ(scene.lights[2], (LightSource{.name = "light2",
                                          .type = LightType::Spot,
                                          .position = {1, 2, 3},
                                          .direction = {0, 0, 1},
                                          .innerAngle = 0,
                                          .outerAngle = 120,
                                          .strength = 5,
                                          .decay = 0}));
  EXPECT_EQ(scene.lighting, (LightingSettings{.backend = Backend::Gpu,
                                              .cutoff = 0,
                                              .endpoint = Endpoint::Clamp,
                                              .radiusScale = 1.5f,
                                              .particlesPerCell = 16,
                                              .subsample = 0.25f,
                                              .autoSubsample = false,
                                              .subsampleSeed = std::numeric_limits<std::uint64_t>::max(),
                                              .compensate = false,
                                              .error = 0.125f,
                                              .solidShadowIntensity = 0.5f}));
  ASSERT_EQ(scene.solids.size(), 2u);
  EXPECT_EQ(scene.solids[0], (Solid{.pointer = "/solids/0",
                                    .name = "ground",
                                    .file = "f/g.####.obj",
                                    .mode = SolidMode::Holdout,
                                    .albedo = {0, 0.5f, 1},
                                    .castsShadows = false,
                                    .receivesShadows = false,
                                    .translate = {1, 2, 3},
                                    .rotate = {4, 5, 6},
                                    .scale = 7}));
  EXPECT_EQ(scene.solids[1], (Solid{.pointer = "/solids/1", .name = "solid1", .file = "/data/m.ply"}));
  const CameraKey first{
      .frame = -1.5f, .position = vec3(1, 2, 3), .target = vec3(4, 5, 6), .up = vec3(0, 1, 1), .fov = 30.0f};
  EXPECT_EQ(scene.camera, (Camera{.position = {0, 0, 9},
                                  .target = {0, 1, 0},
                                  .up = {0, 2, 0},
                                  .fov = 20,
                                  .near = 0.5f,
                                  .far = 50,
                                  .shutter = {-0.5f, 0.25f},
                                  .apertureRadius = 0.125f,
                                  .focusDistance = 6.0f,
                                  .keys = {first, {.frame = 7, .focusDistance = 8.0f}}}));
  EXPECT_EQ(scene.view, (View{Backend::Cpu, 0.5f, "f/c.png", "/data/o.exr"}));
  EXPECT_EQ(scene.output, (Output{.file = "f/o.exr",
                                  .size = {640, 480},
                                  .precision = Precision::Float,
                                  .compression = Compression::Piz,
                                  .pixelAspect = 2,
                                  .depth = true,
                                  .lights = true,
                                  .velocity = true}));
  EXPECT_EQ(scene.frames, (Frames{-3, 9, 2, 25}));
}

TEST(SceneReader, ReadsAnOrthographicCamera) {
  const Camera camera = parseScene(with(R"("camera": {"type": "orthographic", "position": [0, 0, 9], "height": 3,
      "keys": [{"frame": 1, "height": 4}]})"),
                                   "s.json")
                            .camera;
  EXPECT_EQ(camera.projection, Projection::Orthographic);
  EXPECT_EQ(camera.height, 3);
  EXPECT_EQ(camera.keys, (std::vector<CameraKey>{{.frame = 1, .height = 4.0f}}));
  EXPECT_FALSE(camera.fittedHeight);
}

TEST(SceneReader, ReadsEachLayerByItsName) {
  const auto output = [](const std::string& layer) {
    return parseScene(with(R"("output": {"aovs": [")" + layer + R"("]})"), "s.json").output;
  };
  const auto expected = [](bool Output::*layer) {
    Output only;
    only.*layer = true;
    return only;
  };
  EXPECT_EQ(output("Z"), expected(&Output::depth));
  EXPECT_EQ(output("shadow"), expected(&Output::shadow));
  EXPECT_EQ(output("lights"), expected(&Output::lights));
  EXPECT_EQ(output("velocity"), expected(&Output::velocity));
  EXPECT_EQ(output("optical_depth"), expected(&Output::opticalDepth));
}

TEST(SceneReader, TakesAutoForASubsampleBesideAnError) {
  const LightingSettings lighting =
      parseScene(with(R"("lighting": {"subsample": "auto", "error": 0.01})"), "s.json").lighting;
  EXPECT_TRUE(lighting.autoSubsample);
  EXPECT_EQ(lighting.subsample, 1);
  EXPECT_EQ(lighting.error, 0.01f);
  EXPECT_TRUE(contains(errorOf(with(R"("lighting": {"subsample": "auto"})")),
                       R"(/lighting/subsample: expected "auto" only beside an "error" > 0, got "auto" with an error)"));
  EXPECT_TRUE(contains(errorOf(with(R"("lighting": {"subsample": "half"})")),
                       R"(/lighting/subsample: expected a share > 0 and <= 1 or "auto", got "half")"));
}

TEST(SceneReader, TurnsASpotToItsTargetAndElseStraightDown) {
  const auto spot = [](const std::string& keys) {
    return parseScene(with(R"("lights": [{"type": "spot", "position": [1, 2, 3])" + keys + "}]"), "s.json").lights[0];
  };
  // Components are within 2 roundings of 0.6 and 0.8, a rounding being 2^-25 there.
  EXPECT_NEAR(spot(R"(, "target": [4, 2, 7])").direction.x, 0.6, 6e-8);
  EXPECT_NEAR(spot(R"(, "target": [4, 2, 7])").direction.z, 0.8, 6e-8);
  EXPECT_EQ(spot("").direction, vec3(0, -1, 0));
}

TEST(SceneReader, LetsTheDefaultOfOneConeGiveWayToTheOther) {
  const auto angles = [](const std::string& keys) {
    const LightSource light = parseScene(with(R"("lights": [{"type": "spot")" + keys + "}]"), "s.json").lights[0];
    return vec2(light.innerAngle, light.outerAngle);
  };
  EXPECT_EQ(angles(""), vec2(20, 30));
  EXPECT_EQ(angles(R"(, "outer_angle": 10)"), vec2(10, 10));
  EXPECT_EQ(angles(R"(, "inner_angle": 50)"), vec2(50, 50));
  EXPECT_EQ(angles(R"(, "inner_angle": 5)"), vec2(5, 30));
}

TEST(SceneReader, TakesNoLightsForNoLights) {
  const Scene scene = parseScene(with(R"("lights": [])"), "s.json");
  EXPECT_FALSE(scene.defaultLights);
  EXPECT_TRUE(scene.lights.empty());
}

TEST(SceneReader, KeepsADensityScaleInsteadOfTheDefaultOpticalDepth) {
  EXPECT_EQ(parseScene(with(R"("medium": {"falloff": "linear"})"), "s.json").medium.opticalDepth, 4.0f);
  EXPECT_EQ(parseScene(with(R"("medium": {"density_scale": 1})"), "s.json").medium.opticalDepth, std::nullopt);
}

TEST(SceneReader, FitsACameraThatSaysOnlyHowNotWhere) {
  const Camera how = parseScene(with(R"("camera": {"fov": 20, "near": 5})"), "s.json").camera;
  EXPECT_TRUE(how.fitted);
  EXPECT_FALSE(how.fittedDepths);
  EXPECT_EQ(how.fov, 20);
  const Camera where = parseScene(with(R"("camera": {"position": [3, 3, 3]})"), "s.json").camera;
  EXPECT_FALSE(where.fitted);
  EXPECT_EQ(where.far, 1000);
}

TEST(SceneReader, FitsNoCameraWhoseKeysSayWhere) {
  const auto camera = [](const std::string& keys) {
    return parseScene(with(R"("camera": {"type": "orthographic", )" + keys + "}"), "s.json").camera;
  };
  EXPECT_FALSE(camera(R"("keys": [{"frame": 1, "height": 2}, {"frame": 2, "target": [3, 3, 3]}])").fitted);
  const Camera zoom = camera(R"("keys": [{"frame": 1, "height": 2}])");
  EXPECT_TRUE(zoom.fitted);
  EXPECT_TRUE(zoom.fittedHeight);
  EXPECT_FALSE(camera(R"("height": 3)").fittedHeight);
  EXPECT_TRUE(camera(R"("height": 3)").fitted);
}

TEST(SceneReader, EndsTheFramesWithTheFirstWhereNoLastIsGiven) {
  EXPECT_EQ(parseScene(with(R"("frames": {"first": 7})"), "s.json").frames.last, 7);
}

TEST(SceneReader, NormalisesDirectionsInDoublePrecision) {
  // The squares of neither length fit a float.
  for (const char* direction : {"[3e-30, 0, 4e-30]", "[3e17, 0, 4e17]"}) {
    const Scene scene =
        parseScene(with(R"("lights": [{"type":"directional","direction":)" + std::string(direction) + "}]"), "s.json");
    // Components are within 2 roundings of 0.6 and 0.8, a rounding being 2^-25 there.
    EXPECT_NEAR(scene.lights[0].direction.x, 0.6, 6e-8);
    EXPECT_NEAR(scene.lights[0].direction.z, 0.8, 6e-8);
  }
}

TEST(SceneReader, AllowsCommentsAndKeepsSlashesInsideStrings) {
  const Scene scene = parseScene(R"(// first
    {"particles": [ // the "file"
       /* and, {another} */ {"file": "//server/a.prt"} // last
    ]} // end)",
                                 "s.json");
  EXPECT_EQ(scene.particles[0].file, "//server/a.prt");
}

TEST(SceneReader, AllowsAByteOrderMarkWithoutCountingItAsAColumn) {
  EXPECT_EQ(errorOf("\xef\xbb\xbf" + kLeast), "");
  EXPECT_TRUE(contains(errorOf("\xef\xbb\xbf{\"particle\":1}"), "s.json:1:2: /particle: "));
}

// --- --set --------------------------------------------------------------------------------------------------------

TEST(SceneOverrides, ReplaceAddAndAppend) {
  const Scene scene = parseScene(with(R"("lights":[{"name":"a"}], "output":{"size":[1,1]})"), "f/s.json",
                                 Overrides{"/lights/0/intensity=2.5", "/output/file=o.exr", "/particles/0/radius=auto",
                                           "/medium={\"albedo\":[1,1,1]}", "/medium/optical_depth=9", "/camera/fov=30",
                                           "/lights/-={\"name\":\"b\"}", "/lights/1/decay=1", "/output/size/1=100",
                                           "/lights/0/name=first", "/lights/0/name=second"});
  EXPECT_EQ(scene.lights.at(0).strength, 2.5f);
  EXPECT_EQ(scene.lights.at(0).name, "second");
  EXPECT_EQ(scene.lights.at(1).name, "b");
  EXPECT_EQ(scene.lights.at(1).decay, 1);
  EXPECT_EQ(scene.output.file, "f/o.exr");
  EXPECT_EQ(scene.medium.albedo, vec3(1));
  EXPECT_EQ(scene.medium.opticalDepth, 9.0f);
  EXPECT_EQ(scene.camera.fov, 30);
  EXPECT_EQ(scene.output.size, ivec2(1, 100));
  EXPECT_TRUE(scene.camera.fitted);
}

TEST(SceneOverrides, MakeTheArrayThatTheyAddressInto) {
  EXPECT_EQ(parseScene("{}", "s.json", Overrides{"/particles/0/file=a=b.prt"}).particles.at(0).file, "a=b.prt");
}

TEST(SceneOverrides, NameThemselvesInErrors) {
  struct Case {
    const char *flag, *part;
  };
  for (const Case& c : {
           Case{"/lights/0/intensity=-3",
                "--set /lights/0/intensity=-3: /lights/0/intensity: expected a number >= 0 [W/sr], got -3"},
           Case{"/lights/0/intensty=3", "/lights/0/intensty: expected a key of a light"},
           Case{"/lights/7/intensity=3", "/lights: expected an index from 0 to 0"},
           Case{"/particles/00/density=3", "/particles: expected an index from 0 to 1"},
           Case{"/particles/x=3", "/particles: expected an index"},
           Case{"/particles/0/file/x=3", "/particles/0/file: expected an object or array to go into, got \"x.prt\""},
           Case{"/medium", "there is no ="},
           Case{"medium=3", "it begins with /"},
           Case{"=3", "it must name a key"},
           Case{"/a~2=3", "~ is written ~0"},
           Case{"/medium={\"albedo\":[1,2", "/medium/albedo: expected a closing ]"},
           Case{"/medium={\"falloff\":1,\"falloff\":2}", "the key \"falloff\" again"},
           Case{"/lighting/cutoff=NaN", "got \"NaN\""},
           Case{"/lighting/cutoff=1e400", "got \"1e400\""},
           Case{"/mote=", "got \"\""},
       }) {
    const std::string message = errorOf(with(R"("lights":[])"), Overrides{c.flag});
    EXPECT_EQ(message.rfind("--set", 0), 0u) << message;
    EXPECT_TRUE(contains(message, c.part));
  }
}

TEST(SceneOverrides, CanMendASceneBeforeItIsChecked) {
  EXPECT_EQ(errorOf(with(R"("mote":99)"), Overrides{"/mote=1"}), "");
}

}  // namespace
}  // namespace mote
