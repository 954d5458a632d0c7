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
  EXPECT_EQ(scene.lighting.cutoff, 1e-4f);
  EXPECT_EQ(scene.output.size, ivec2(1280, 720));
  EXPECT_EQ(scene.output.file, "folder/mote.####.exr");
  EXPECT_EQ(scene.frames, Frames{});
}

TEST(SceneReader, ReadsEveryKey) {
  const Scene scene = parseScene(R"({
    "mote": 1,
    "particles": [
      {"file": "/data/p.####.prt", "radius": {"channel": "pscale", "scale": 2}, "channels": {"Density": "rho", "ID": "n"},
       "density": 3, "color": [0.1, 0.2, 0.3], "translate": [1, 2, 3], "rotate": [4, 5, 6], "scale": 7},
      {"generate": "cloud", "count": 350000, "seed": 18446744073709551615, "radius": 0.25},
      {"generate": "ball", "count": 1e6, "radius": "auto"}],
    "medium": {"density_mode": "peak", "density_scale": 0.5, "falloff": "sphere", "albedo": [1, 0, 0.5],
               "phase": {"type": "isotropic"}},
    "lights": [
      {"name": "key", "type": "point", "position": [2, 3, 1], "color": [2, 1, 0], "intensity": 60, "decay": 1,
       "shadow_density": 0.5, "casts_shadows": false},
      {"type": "directional", "direction": [0, -2, 0], "irradiance": 4}],
    "lighting": {"backend": "gpu", "cutoff": 0, "endpoint": "clamp", "particles_per_cell": 16},
    "camera": {"type": "perspective", "position": [0, 0, 9], "target": [0, 1, 0], "up": [0, 2, 0], "fov": 20,
               "near": 0.5, "far": 50},
    "view": {"backend": "cpu"},
    "output": {"file": "o.exr", "size": [640, 480], "precision": "float", "compression": "piz", "aovs": ["Z"]},
    "frames": {"first": -3, "last": 9, "step": 2, "fps": 25}
  })",
                                 "f/s.json");
  ASSERT_EQ(scene.particles.size(), 3u);
  const ParticleSource& file = scene.particles[0];
  EXPECT_EQ(file.file, "/data/p.####.prt");
  EXPECT_EQ(file.radius, (RadiusRule{RadiusRule::Kind::Channel, 0, "pscale", 2}));
  EXPECT_EQ(file.channels, (std::map<std::string, std::string>{{"Density", "rho"}, {"ID", "n"}}));
  EXPECT_EQ(file.density, 3);
  EXPECT_EQ(file.color, vec3(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(file.translate, vec3(1, 2, 3));
  EXPECT_EQ(file.rotate, vec3(4, 5, 6));
  EXPECT_EQ(file.scale, 7);
  EXPECT_EQ(scene.particles[1].generate, Generator::Cloud);
  EXPECT_EQ(scene.particles[1].count, 350000u);
  EXPECT_EQ(scene.particles[1].seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(scene.particles[1].radius, (RadiusRule{RadiusRule::Kind::Number, 0.25f, "Radius", 1}));
  EXPECT_EQ(scene.particles[2].count, 1000000u);
  EXPECT_EQ(scene.medium, (Medium{DensityMode::Peak, 0.5f, std::nullopt, Falloff::Sphere, {1, 0, 0.5f}}));
  ASSERT_EQ(scene.lights.size(), 2u);
  EXPECT_EQ(scene.lights[0],
            (LightSource{"key", LightType::Point, {2, 3, 1}, {0, -1, 0}, {2, 1, 0}, 60, 1, 0.5f, false}));
  EXPECT_EQ(scene.lights[1].name, "light1");
  EXPECT_EQ(scene.lights[1].direction, vec3(0, -1, 0));
  EXPECT_EQ(scene.lights[1].strength, 4);
  EXPECT_EQ(scene.lighting, (LightingSettings{Backend::Gpu, 0, Endpoint::Clamp, 16}));
  EXPECT_EQ(scene.camera, (Camera{false, false, {0, 0, 9}, {0, 1, 0}, {0, 2, 0}, 20, 0.5f, 50}));
  EXPECT_EQ(scene.view.backend, Backend::Cpu);
  EXPECT_EQ(scene.output, (Output{"f/o.exr", {640, 480}, Precision::Float, Compression::Piz, true}));
  EXPECT_EQ(scene.frames, (Frames{-3, 9, 2, 25}));
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

TEST(SceneReader, TellsKeysOfLaterVersionsFromUnknownOnes) {
  for (const char* keys :
       {R"("solids": [])", R"("medium": {"extinction": [1,1,1]})", R"("medium": {"emission_scale": 1})",
        R"("lighting": {"radius_scale": 1})", R"("lighting": {"subsample": 1})", R"("lighting": {"error": 0})",
        R"("camera": {"shutter": [0,0]})", R"("view": {"sprite_color": ""})", R"("view": {"radius_scale": 1})",
        R"("lights": [{"inner_angle": 3}])", R"("lights": [{"type": "spot"}])",
        R"("medium": {"phase": {"type": "henyey_greenstein"}})", R"("medium": {"phase": {"type": "rayleigh"}})",
        R"("camera": {"type": "orthographic"})", R"("output": {"aovs": ["shadow"]})"}) {
    const std::string message = errorOf(with(keys));
    EXPECT_TRUE(contains(message, "does not support yet")) << keys;
    EXPECT_FALSE(contains(message, "unknown")) << keys;
  }
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
  EXPECT_TRUE(
      contains(source(R"("file":"x","count":5)"), R"(/particles/0/count: expected "count" only beside "generate")"));
  EXPECT_TRUE(contains(source(R"("file":"x","seed":5)"), R"(/particles/0/seed: )"));
  EXPECT_TRUE(contains(source(R"("generate":"ball","count":1,"channels":{})"), R"(/particles/0/channels: )"));
  EXPECT_TRUE(contains(errorOf(with(R"("medium":{"density_scale":1,"optical_depth":4})")),
                       R"(/medium/optical_depth: expected either "density_scale" or "optical_depth", got both)"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"direction":[1,0,0]}])")), "a point light has a position"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"directional","intensity":1}])")), "has an irradiance"));
  EXPECT_TRUE(contains(errorOf(with(R"("lights":[{"type":"directional","decay":1}])")), "/lights/0/decay: "));
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

TEST(SceneReader, RefusesDirectionsAndCamerasThatPointNowhere) {
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
