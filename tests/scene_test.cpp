// The scene parser: what it reads, and that every mistake gets a message with its place, pointer and remedy.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "host/core/error.h"
#include "host/scene/scene_reader.h"

namespace mote {
namespace {

using Overrides = std::vector<std::string>;

const std::string kLeast = R"({"particles":[{"file":"x.prt"}]})";

/// A scene of one particle file and these further keys of the root.
std::string with(const std::string& keys) { return R"({"particles":[{"file":"x.prt"}],)" + keys + "}"; }

/// The message of the InputError that parsing throws; "" if it throws none.
std::string errorOf(const std::string& text, const Overrides& overrides = {}) {
  try {
    parseScene(text, "s.json", overrides);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

testing::AssertionResult contains(const std::string& message, const std::string& part) {
  if (message.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "'" << message << "' does not contain '" << part << "'";
}

class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::path(testing::TempDir()) / ("mote_scene_test_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string write(const std::string& name, const std::string& bytes) const {
    const std::string path = (path_ / name).string();
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  std::string path(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

// --- what is read -------------------------------------------------------------------------------------------------

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

// --- where and how mistakes are reported --------------------------------------------------------------------------

TEST(SceneReader, NamesFileLineColumnPointerExpectedAndGot) {
  const std::string text =
      "{\n  \"particles\": [{\"file\": \"x.prt\"}],\n  \"lights\": [{\n    \"intensity\":  -3\n  }]\n}";
  EXPECT_EQ(errorOf(text), "s.json:4:19: /lights/0/intensity: expected a number >= 0 [W/sr], got -3");
}

TEST(SceneReader, CountsLinesOfEveryKindAndColumnsInCharacters) {
  EXPECT_TRUE(
      contains(errorOf("{\r\n\"particles\":[{\"file\":\"\xc3\xa4\xe2\x82\xac\", \"densty\":1}]}"), "s.json:2:28: "));
  EXPECT_TRUE(contains(errorOf("// \xc3\xa4\n/* two\nlines */ {\"x\":1}"), "s.json:3:11: /x: "));
  EXPECT_TRUE(contains(errorOf(R"({"a\"b\\":1, "particles":[]})"), R"(s.json:1:2: /a"b\: )"));
}

TEST(SceneReader, HintsAtTheNearestKey) {
  struct Case {
    const char *text, *pointer, *hint;
  };
  for (const Case& c :
       {Case{R"({"particle":[]})", "/particle", "particles"},
        Case{R"({"particles":[{"file":"x","raduis":1}]})", "/particles/0/raduis", "radius"},
        Case{R"({"particles":[{"file":"x"}],"camera":{"FOV":1}})", "/camera/FOV", "fov"},
        Case{R"({"particles":[{"file":"x"}],"medium":{"phase":{"typ":1}}})", "/medium/phase/typ", "type"},
        Case{R"({"particles":[{"file":"x","channels":{"Colour":"a"}}]})", "/particles/0/channels/Colour", "Color"}}) {
    const std::string message = errorOf(c.text);
    EXPECT_TRUE(contains(message, std::string(": ") + c.pointer + ": "));
    EXPECT_TRUE(contains(message, std::string("the nearest is \"") + c.hint + "\""));
  }
}

TEST(SceneReader, PutsAMisspeltKeyBeforeWhatItLeavesMissing) {
  // Without the rule the first message would be that "count" is missing.
  EXPECT_TRUE(contains(errorOf(R"({"particles":[{"generate":"ball","cuont":5}]})"), "/particles/0/cuont: "));
}

TEST(SceneReader, NamesBothLinesOfADuplicateKey) {
  const std::string message = errorOf("{\"particles\":[{\"file\":\"x\",\n\"density\":1,\n \"density\":1}]}");
  EXPECT_TRUE(contains(message, "s.json:3:2: /particles/0/density: "));
  EXPECT_TRUE(contains(message, "first given at 2:1"));
}

TEST(SceneReader, SaysInWordsWhatTheSyntaxLacks) {
  struct Case {
    std::string text, place, words;
  };
  const std::vector<Case> cases = {
      {"", "1:1", "an empty file"},
      {" \n\t", "1:1", "an empty file"},
      {"// only this", "1:1", "an empty file"},
      {R"({"a":[1,2,]})", "1:11", "no comma after the last entry"},
      {R"({"a":1,})", "1:8", "no comma after the last entry"},
      {R"({"a":"b)", "1:6", "closing quote"},
      {"{\"a\":\"b\n\"}", "1:6", "closing quote"},
      {R"({"a":1 "b":2})", "1:8", "expected a comma or a closing }, got \"b\" (is a comma missing?)"},
      {R"({"a" 1})", "1:6", "a colon after the key"},
      {R"({a:1})", "1:2", "a key in double quotes, got a"},
      {R"({"a":,})", "1:6", "a JSON value"},
      {R"({"a":'b'})", "1:6", "text stands in double quotes"},
      {R"({"a":NaN})", "1:6", "got NaN"},
      {R"({"a":-Infinity})", "1:6", "got -Infinity"},
      {R"({"a":01})", "1:7", "a comma or a closing }"},
      {R"({"a":1.})", "1:6", "got 1."},
      {R"({"a":[1}})", "1:8", "a comma or a closing ], got }"},
      {R"({"a":[{"b":1})", "1:14", "closing ] for the [ at 1:6"},
      {R"({"a":"\q"})", "1:6", "forbidden character after backslash"},
      {"{\"a\":\"\xff\"}", "1:6", "not UTF-8"},
      {"{\"a\":\xff}", "1:6", "\\xff"},
      {R"({"a":1e400})", "1:6", "got 1e400"},
      {R"({"a":1} {)", "1:9", "the end of the file after the scene"},
      {"{} /* open", "1:4", "comment"},
      {std::string("{}\0{}", 5), "1:3", "a zero byte"},
  };
  for (const Case& c : cases) {
    const std::string message = errorOf(c.text);
    EXPECT_EQ(message.rfind("s.json:" + c.place + ": ", 0), 0u) << message << "\n" << c.text;
    EXPECT_TRUE(contains(message, c.words)) << c.text;
  }
}

TEST(SceneReader, RefusesEveryTruncationOfAScene) {
  const std::string text = R"({"particles":[{"file":"a\"b","density":-1.5e3,"x":true}]})";
  for (std::size_t size = 0; size < text.size(); ++size) {
    const std::string message = errorOf(text.substr(0, size));
    EXPECT_EQ(message.rfind("s.json:1:", 0), 0u) << text.substr(0, size) << "\n" << message;
  }
}

TEST(SceneReader, SurvivesEverySingleByteChangedToEachOfTheGrammarsCharacters) {
  const std::string text = R"({"particles":[{"file":"x"}], "lights":[{"decay":1.5}] /*c*/ })";
  std::size_t good = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    for (const char c : std::string("{}[]\",:/*0-.e\\tn\n\xff")) {
      std::string changed = text;
      changed[i] = c;
      const std::string message = errorOf(changed);
      EXPECT_TRUE(message.empty() || message.rfind("s.json:", 0) == 0) << message;
      good += message.empty();
    }
  }
  EXPECT_GT(good, 0u);  // a changed blank or file name does no harm
}

TEST(SceneReader, RefusesDeepNestingWithoutRecursion) {
  EXPECT_TRUE(contains(errorOf(std::string(1'000'000, '[')), "s.json:1:65: expected at most 64 arrays and objects"));
  std::string objects;
  for (int i = 0; i < 100'000; ++i) objects += "{\"a\":";
  EXPECT_TRUE(contains(errorOf(objects), "s.json:1:321: expected at most 64"));
  const std::string allowed = with(R"("lights":)" + std::string(63, '[') + std::string(63, ']'));
  EXPECT_TRUE(contains(errorOf(allowed), "/lights/0: expected an object, got an array of 1"));
}

TEST(SceneReader, RefusesARootThatIsNoObject) {
  for (const char* text : {"[]", "1", "\"a\"", "true", "null"})
    EXPECT_TRUE(contains(errorOf(text), "s.json:1:1: expected a JSON object, got ")) << text;
}

TEST(SceneReader, RefusesMissingAndEmptyParticles) {
  EXPECT_TRUE(contains(errorOf("{}"), R"(s.json:1:1: expected "particles" with at least one source, got none)"));
  EXPECT_TRUE(contains(errorOf(R"({"particles":[]})"), "s.json:1:14: /particles: expected \"particles\" with"));
  EXPECT_TRUE(contains(errorOf(R"({"particles":{}})"), "/particles: expected an array of objects, got an object"));
  EXPECT_TRUE(contains(errorOf(R"({"particles":["x.prt"]})"), "/particles/0: expected an object, got \"x.prt\""));
}

TEST(SceneReader, NamesWhatAValueIsInsteadOfWhatItShouldBe) {
  for (const auto& [value, shown] : std::map<std::string, std::string>{{"null", "null"},
                                                                       {"true", "true"},
                                                                       {"\"7\"", "\"7\""},
                                                                       {"[7]", "an array of 1"},
                                                                       {"{}", "an object"},
                                                                       {"-0.5", "-0.5"}}) {
    const std::string message = errorOf(with(R"("medium": {"optical_depth": )" + value + "}"));
    EXPECT_TRUE(contains(message, "/medium/optical_depth: expected a number > 0, got " + shown));
  }
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"casts_shadows":1}])")), "expected true or false, got 1"));
  EXPECT_TRUE(contains(errorOf(with(R"("output":{"file":3})")), "/output/file: expected text"));
  EXPECT_TRUE(contains(errorOf(with(R"("output":{"size":[1280,720.5]})")), "/output/size/1: expected a whole number"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"up":[0,1]})")), "/camera/up: expected an array of 3 numbers"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":3)")), "/camera: expected an object, got 3"));
  EXPECT_TRUE(contains(errorOf(with(R"("medium":{"falloff":"smoth"})")),
                       R"(expected "smooth", "linear" or "sphere", got "smoth" (the nearest is "smooth"))"));
}

TEST(SceneReader, RefusesNumbersThatLeaveTheirRangeByRounding) {
  EXPECT_TRUE(
      contains(errorOf(with(R"("medium":{"optical_depth":1e-60})")), "/medium/optical_depth: expected a number > 0"));
  EXPECT_TRUE(
      contains(errorOf(with(R"("camera":{"fov":179.999999999})")), "/camera/fov: expected a number > 0 and < 180"));
  EXPECT_TRUE(contains(errorOf(with(R"("medium":{"density_scale":1e39})")), "up to 3.4e38"));
}

TEST(SceneReader, TakesWholeNumbersHoweverTheyAreWritten) {
  const auto count = [](const char* literal) {
    return parseScene(R"({"particles":[{"generate":"ball","count":)" + std::string(literal) + "}]}", "s")
        .particles[0]
        .count;
  };
  EXPECT_EQ(count("1e6"), 1000000u);
  EXPECT_EQ(count("2.0"), 2u);
  for (const char* literal : {"0", "-1", "1.5", "4000000001", "1e300", "18446744073709551616", "\"5\""})
    EXPECT_TRUE(contains(errorOf(R"({"particles":[{"generate":"ball","count":)" + std::string(literal) + "}]}"),
                         "/particles/0/count: expected a whole number from 1 to 4000000000"))
        << literal;
}

TEST(SceneReader, RefusesKeysThatContradictEachOther) {
  const auto source = [](const std::string& keys) { return errorOf(R"({"particles":[{)" + keys + "}]}"); };
  EXPECT_TRUE(
      contains(source(R"("file":"x","generate":"ball","count":1)"), R"(either "file" or "generate", got both)"));
  EXPECT_TRUE(contains(source(R"("density":1)"), R"(/particles/0: expected "file" or "generate", got neither)"));
  EXPECT_TRUE(
      contains(source(R"("generate":"ball")"), R"(/particles/0: expected "count" beside "generate", got none)"));
  EXPECT_TRUE(contains(source(R"("file":"x","count":0)"), R"(/particles/0/count: )"));
  EXPECT_TRUE(contains(source(R"("generate":"ball","count":1,"grid":"density")"),
                       R"(/particles/0/grid: expected "grid" only beside "file")"));
  EXPECT_TRUE(contains(source(R"("generate":"ball","count":1,"channels":{})"), R"(/particles/0/channels: )"));
  EXPECT_TRUE(contains(errorOf(with(R"("medium":{"density_scale":1,"optical_depth":4})")),
                       R"(/medium/optical_depth: expected either "density_scale" or "optical_depth", got both)"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"direction":[1,0,0]}])")), "a point light has a position"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"directional","intensity":1}])")), "has an irradiance"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"directional","decay":1}])")), "/lights/0/decay: "));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"target":[1,0,0]}])")),
                       R"(/lights/0/target: expected "target" only in spot lights, got "target" here)"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"inner_angle":3}])")), R"("inner_angle" only in spot lights)"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"directional","outer_angle":3}])")),
                       R"("outer_angle" only in spot lights)"));
  EXPECT_TRUE(
      contains(errorOf(with(R"("lights":[{"type":"spot","direction":[0,0,1]}])")), "a spot light has a target"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"spot","irradiance":1}])")), "a spot light has an intensity"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"spot","inner_angle":31,"outer_angle":30}])")),
                       "/lights/0/inner_angle: expected inner_angle <= outer_angle, got inner 31 and outer 30"));
  EXPECT_TRUE(contains(errorOf(with(R"("medium":{"phase":{"type":"rayleigh","g":0}})")),
                       R"(/medium/phase/g: expected "g" only in the phase function "henyey_greenstein")"));
  EXPECT_TRUE(contains(errorOf(with(R"("medium":{"phase":{"type":"henyey_greenstein"}})")),
                       R"(/medium/phase: expected "g", the mean cosine, beside "henyey_greenstein", got none)"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"height":3})")), "a perspective camera has a fov"));
  EXPECT_TRUE(
      contains(errorOf(with(R"("camera":{"type":"orthographic","fov":3})")), "an orthographic camera has a height"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"keys":[{"frame":1,"height":3}]})")),
                       R"(/camera/keys/0/height: expected "height" only in an orthographic camera)"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"shutter":[0.5,0.25]})")),
                       "/camera/shutter: expected a time of opening <= that of closing, got [0.5, 0.25]"));
  EXPECT_TRUE(contains(errorOf(with(R"("frames":{"first":5,"last":4})")),
                       "/frames/last: expected a last frame >= the first, 5, got 4"));
  EXPECT_TRUE(contains(errorOf(with(R"("mote":2)")), "/mote: expected 1, the version of the scene format, got 2"));
}

TEST(SceneReader, RefusesLightNamesThatAreNoChannelNamesOrNotUnique) {
  for (const char* name : {"", "9lives", "key light", "k-1", "eighteen_letters__", "k\\u00e9"})
    EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"name":")" + std::string(name) + "\"}]")), "/lights/0/name: "))
        << name;
  EXPECT_EQ(errorOf(with(R"("lights":[{"name":"seventeen_letters"},{"name":"_9"}])")), "");
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"name":"a"},{"name":"a"}])")),
                       "/lights/1/name: expected a name that no other light has"));
  // The first light's name is the one that the second gets by its place.
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"name":"light1"},{}])")),
                       "/lights/1: expected a name that no other light has, got \"light1\""));
}

TEST(SceneReader, RefusesSolidsWithoutAFileOrANameOfTheirOwn) {
  EXPECT_TRUE(
      contains(errorOf(with(R"("solids":[{"name":"a"}])")), R"(/solids/0: expected "file", the mesh, got none)"));
  EXPECT_TRUE(
      contains(errorOf(with(R"("solids":[{"file":"a.obj","name":"a b"}])")), "/solids/0/name: expected a name"));
  EXPECT_TRUE(contains(errorOf(with(R"("solids":[{"file":"a.obj","name":"solid1"},{"file":"b.obj"}])")),
                       R"(/solids/1: expected a name that no other solid has, got "solid1" (/solids/0 has it))"));
  // A light and a solid may share a name.
  EXPECT_EQ(errorOf(with(R"("solids":[{"file":"a.obj","name":"a"}],"lights":[{"name":"a"}])")), "");
}

TEST(SceneReader, RefusesCameraKeysOutOfOrderOrWithoutAView) {
  const auto message = [](const std::string& keys) { return errorOf(with(R"("camera":{"keys":[)" + keys + "]}")); };
  for (const char* frame : {"2", "1", "2.00000001"})  // the last is 2 in single precision
    EXPECT_TRUE(contains(message(R"({"frame":2,"fov":30},{"frame":)" + std::string(frame) + R"(,"fov":30})"),
                         "/camera/keys/1/frame: expected a frame after that of the key before, 2, got "));
  EXPECT_TRUE(contains(message(R"({"frame":2})"), R"(/camera/keys/0: expected something beside "frame")"));
  EXPECT_TRUE(contains(message(R"({"fov":2})"), R"(/camera/keys/0: expected "frame", the frame that the key is at)"));
  EXPECT_TRUE(contains(message(R"({"frame":1,"up":[0,0,0]})"), "/camera/keys/0/up: expected a direction that is not"));
  EXPECT_TRUE(contains(message(R"({"frame":1,"position":[1,2,3]},{"frame":2,"target":[1,2,3]})"),
                       "/camera/keys/0/position: expected a target that is not the camera's position"));
  EXPECT_TRUE(contains(message(R"({"frame":1,"position":[1,2,3]},{"frame":2,"position":[0,5,0],"target":[0,0,0]})"),
                       "/camera/keys/1/target: expected an up direction that is not along the view direction"));
  // Where no key moves the view, the camera itself is to blame.
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"position":[0,5,0],"target":[0,0,0],"keys":[{"frame":1,"fov":9}]})")),
                       "/camera/target: expected an up direction"));
  // And what all keys replace may be anything.
  EXPECT_EQ(errorOf(with(R"("camera":{"position":[0,5,0],"target":[0,0,0],"keys":[{"frame":1,"up":[0,0,1]}]})")), "");
}

TEST(SceneReader, RefusesDirectionsAndCamerasThatPointNowhere) {
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"spot","position":[1,2,3],"target":[1,2,3]}])")),
                       "/lights/0/target: expected a target that is not the light's position"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"directional","direction":[0,0,-0.0]}])")),
                       "/lights/0/direction: expected a direction that is not zero"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"position":[1,2,3],"target":[1,2,3]})")),
                       "/camera/target: expected a target that is not"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"up":[0,0,0]})")), "/camera/up: "));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"position":[0,5,0],"target":[0,0,0]})")),
                       "/camera/target: expected an up direction that is not along"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"position":[3,3,3],"target":[1,1,1],"up":[-1,-1,-1]})")),
                       "/camera/up: expected an up direction"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"near":2,"far":2})")),
                       "/camera/far: expected near < far, got near 2 and far 2"));
  EXPECT_TRUE(contains(errorOf(with(R"("camera":{"near":5000})")), "/camera/near: expected near < far"));
}

TEST(SceneReader, RefusesFileNamesThatNoFileCanHave) {
  EXPECT_TRUE(contains(errorOf(R"({"particles":[{"file":""}]})"), "/particles/0/file: expected text"));
  EXPECT_TRUE(contains(errorOf(R"({"particles":[{"file":"a\u0000.prt"}]})"), R"("a\x00.prt")"));
  EXPECT_TRUE(contains(errorOf(R"({"particles":[{"file":"a.##.##.prt"}]})"),
                       "/particles/0/file: expected at most one run of #"));
  EXPECT_TRUE(contains(errorOf(with(R"("solids":[{"file":"a.##.##.obj"}])")), "/solids/0/file: expected at most one"));
  EXPECT_TRUE(contains(errorOf(with(R"("view":{"sprite_color":"a\u0000"})")), "/view/sprite_color: expected text"));
  EXPECT_EQ(parseScene(with(R"("view":{"sprite_opacity":""})"), "f/s.json").view.spriteOpacity, "");
  EXPECT_EQ(parseScene(kLeast, "C#/s.json").particles[0].file, "C#/x.prt");
}

TEST(SceneReader, ReadsFilesAndSaysWhatElseAFileIs) {
  const TemporaryFolder folder;
  EXPECT_EQ(readScene(folder.write("s.json", kLeast)).particles[0].file, folder.path("x.prt"));
  const auto message = [](const std::string& path) {
    try {
      readScene(path);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(contains(message(folder.path("none.json")), "none.json: cannot read the scene: No such file"));
  EXPECT_TRUE(contains(message(folder.path("")), "Is a directory"));
  EXPECT_TRUE(contains(message(folder.write("p.prt", "\xc0PRT\r\n\x1a\n")), "expected a scene, got a particle file"));
  EXPECT_TRUE(contains(message(folder.write("u.json", "\xff\xfe{")), "UTF-16"));
  EXPECT_TRUE(contains(message(folder.write("e.json", "")), "e.json:1:1: expected a JSON object, got an empty file"));
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
