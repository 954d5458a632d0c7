// The scene parser: every mistake gets a message with its place, pointer and remedy.
#include <gtest/gtest.h>

#include "tests/support/scene_text.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

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
  const TempFolder folder;
  const auto written = [&](const std::string& name, const std::string& bytes) {
    writeBytes(folder.file(name), bytes);
    return folder.file(name);
  };
  EXPECT_EQ(readScene(written("s.json", kLeast)).particles[0].file, folder.file("x.prt"));
  const auto message = [](const std::string& path) {
    try {
      readScene(path);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(contains(message(folder.file("none.json")), "none.json: cannot read the scene: No such file"));
  EXPECT_TRUE(contains(message(folder.path()), "Is a directory"));
  EXPECT_TRUE(contains(message(written("p.prt", "\xc0PRT\r\n\x1a\n")), "expected a scene, got a particle file"));
  EXPECT_TRUE(contains(message(written("u.json", "\xff\xfe{")), "UTF-16"));
  EXPECT_TRUE(contains(message(written("e.json", "")), "e.json:1:1: expected a JSON object, got an empty file"));
}

}  // namespace
}  // namespace mote
