// Holds ../scenes/scene.schema.json and the parser together: the parser accepts exactly what the schema accepts, at
// every key and around every bound, knows exactly its keys, and has its defaults.
// GCC 12 warns about its own <regex> under -fsanitize (GCC bug 105562).
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "host/core/error.h"
#include "host/scene/scene_reader.h"
#include "tests/support/gltf.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using nlohmann::json;
using Pointer = json::json_pointer;

const json& schema() {
  static const json loaded = [] {
    std::ifstream file(MOTE_SOURCE_DIR "/scenes/scene.schema.json");
    return json::parse(file);
  }();
  return loaded;
}

/// The schema behind a $ref, with the keywords beside it.
json resolved(const json& node) {
  if (!node.contains("$ref")) return node;
  json merged = resolved(schema().at(Pointer(node["$ref"].get<std::string>().substr(1))));
  for (const auto& [keyword, value] : node.items())
    if (keyword != "$ref") merged[keyword] = value;
  return merged;
}

bool hasType(const std::string& type, const json& value) {
  if (type == "integer") return value.is_number() && std::trunc(value.get<double>()) == value.get<double>();
  if (type == "number") return value.is_number();
  if (type == "string") return value.is_string();
  if (type == "boolean") return value.is_boolean();
  if (type == "array") return value.is_array();
  return type == "object" && value.is_object();
}

/// 64 bits of mantissa hold every integer of JSON; nlohmann's own < reads 2^64 − 1 as −1 beside a signed number.
long double exactly(const json& value) {
  if (value.is_number_unsigned()) return static_cast<long double>(value.get<std::uint64_t>());
  if (value.is_number_integer()) return static_cast<long double>(value.get<std::int64_t>());
  return static_cast<long double>(value.get<double>());
}

/// The part of JSON Schema that the file uses; KnowsEveryKeywordOfTheSchema holds it to that.
const std::set<std::string> kKeywords = {"$schema",
                                         "$id",
                                         "$defs",
                                         "$ref",
                                         "title",
                                         "description",
                                         "default",
                                         "type",
                                         "properties",
                                         "required",
                                         "items",
                                         "minItems",
                                         "maxItems",
                                         "minProperties",
                                         "uniqueItems",
                                         "enum",
                                         "const",
                                         "minimum",
                                         "maximum",
                                         "pattern",
                                         "oneOf",
                                         "not",
                                         "exclusiveMinimum",
                                         "exclusiveMaximum",
                                         "additionalProperties"};

bool accepts(const json& unresolved, const json& value) {
  const json node = resolved(unresolved);
  if (node.contains("type") && !hasType(node["type"], value)) return false;
  if (node.contains("const") && node["const"] != value) return false;
  if (node.contains("enum") && std::find(node["enum"].begin(), node["enum"].end(), value) == node["enum"].end())
    return false;
  if (value.is_number()) {
    const auto bound = [&](const char* keyword) { return exactly(node[keyword]); };
    if (node.contains("minimum") && exactly(value) < bound("minimum")) return false;
    if (node.contains("maximum") && exactly(value) > bound("maximum")) return false;
    if (node.contains("exclusiveMinimum") && exactly(value) <= bound("exclusiveMinimum")) return false;
    if (node.contains("exclusiveMaximum") && exactly(value) >= bound("exclusiveMaximum")) return false;
  }
  if (value.is_string() && node.contains("pattern") &&
      !std::regex_search(value.get<std::string>(), std::regex(node["pattern"].get<std::string>())))
    return false;
  if (value.is_array()) {
    if (node.contains("minItems") && value.size() < node["minItems"]) return false;
    if (node.contains("maxItems") && value.size() > node["maxItems"]) return false;
    if (node.value("uniqueItems", false) && std::set<json>(value.begin(), value.end()).size() != value.size())
      return false;
    for (const json& item : value)
      if (node.contains("items") && !accepts(node["items"], item)) return false;
  }
  if (value.is_object()) {
    if (value.size() < node.value("minProperties", 0u)) return false;
    for (const json& key : node.value("required", json::array()))
      if (!value.contains(key.get<std::string>())) return false;
    for (const auto& [key, member] : value.items()) {
      const bool known = node.contains("properties") && node["properties"].contains(key);
      if (known && !accepts(node["properties"][key], member)) return false;
      if (!known && node.contains("additionalProperties")) return false;
    }
  }
  if (node.contains("not") && accepts(node["not"], value)) return false;
  if (!node.contains("oneOf")) return true;
  return std::count_if(node["oneOf"].begin(), node["oneOf"].end(),
                       [&](const json& choice) { return accepts(choice, value); }) == 1;
}

void addNumbers(const json& bound, bool integer, std::vector<json>& values) {
  values.push_back(bound);
  if (integer && bound.is_number_unsigned()) {
    const auto b = bound.get<std::uint64_t>();
    // The 64-bit maximum has no neighbour that JSON readers agree on.
    if (b < std::numeric_limits<std::uint64_t>::max()) values.push_back(b + 1);
    values.push_back(b == 0 ? json(-1) : json(b - 1));
  } else if (integer) {
    values.push_back(bound.get<std::int64_t>() + 1);
    values.push_back(bound.get<std::int64_t>() - 1);
  } else {
    // Neighbours in single precision, which is what the parser keeps.
    const auto b = bound.get<float>();
    values.push_back(std::nextafter(b, -INFINITY));
    values.push_back(std::nextafter(b, INFINITY));
  }
}

/// Values of every type, and those around each bound that the schema has for this place.
std::vector<json> candidates(const json& unresolved) {
  const json node = resolved(unresolved);
  const json vectorSample = {0.25, 0.5, 0.75};
  std::vector<json> values = {nullptr,
                              true,
                              false,
                              0,
                              1,
                              2,
                              -1,
                              0.5,
                              1.5,
                              2.0,
                              1e6,
                              -0.0,
                              "",
                              "text",
                              "auto",
                              "9a",
                              "a-b",
                              "a\nb",
                              "_",
                              "1",
                              json::array(),
                              json::object(),
                              vectorSample,
                              {1, 2},
                              {1, 2, 3, 4},
                              {"a", "b", "c"},
                              "seventeen_letters",
                              "eighteen_letters__",
                              {{"no_such_key", 1}},
                              "Z",
                              {"Z"},
                              {"Z", "Z"}};
  for (const char* keyword : {"minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"})
    if (node.contains(keyword)) addNumbers(node[keyword], node["type"] == "integer", values);
  for (const json& word : node.value("enum", json::array())) values.push_back(word);
  if (node.contains("const")) values.push_back(node["const"]);
  for (const json& choice : node.value("oneOf", json::array()))
    for (json& value : candidates(choice)) values.push_back(std::move(value));
  if (node.value("type", "") == "array" && !resolved(node["items"]).contains("oneOf")) {
    const std::size_t size = node.value("minItems", 1u);
    for (const json& item : candidates(node["items"])) {
      for (std::size_t i = 0; i < size; ++i) {
        json array = json::array();
        for (std::size_t j = 0; j < size; ++j) array.push_back(size == 3 ? vectorSample[j] : json(j + 1));
        array[i] = item;
        values.push_back(std::move(array));
      }
    }
  }
  return values;
}

/// Text that a place takes: a file's name, unless it must be a name of the scene.
json leastText(const json& property) {
  const std::string file = "x.prt";
  return std::regex_search(file, std::regex(property.value("pattern", ""))) ? file : "x";
}

/// The least object that the schema takes.
json leastObject(const json& node) {
  json object = json::object();
  for (const json& key : node.value("required", json::array())) {
    const json property = resolved(node["properties"][key.get<std::string>()]);
    object[key.get<std::string>()] = property.contains("const")              ? property["const"]
                                     : property.contains("enum")             ? property["enum"][0]
                                     : property.contains("minimum")          ? property["minimum"]
                                     : property.contains("exclusiveMinimum") ? json(0.5)
                                                                             : leastText(property);
  }
  return object;
}

/// Values of other keys under which a key may take its whole range: what the schema cannot say of two keys.
const std::map<std::string, json> kCompanions = {
    {"/camera/near", {{"far", 1e18}}},
    {"/camera/far", {{"near", 1e-18}}},
    {"/camera/position", {{"up", {0.3, 0.5, 0.8}}}},
    {"/camera/target", {{"up", {0.3, 0.5, 0.8}}}},
    {"/camera/keys/0/frame", {{"focus_distance", 3}}},
    {"/camera/keys/0/position", {{"up", {0.3, 0.5, 0.8}}}},
    {"/camera/keys/0/target", {{"up", {0.3, 0.5, 0.8}}}},
    {"/lighting/subsample", {{"error", 0.5}}},
    {"/frames/first", {{"last", 9999999}}},
    {"/frames/last", {{"first", -9999999}}},
};

/// Scenes stand in a folder where each name that candidates() has for a file is a glTF of solids that have those names.
const std::string& sceneFile() {
  static const test::TempFolder folder;
  static const std::string path = [] {
    std::string nodes = R"({"name":"x","mesh":0})", roots = "0";
    const std::vector<std::string> names{"text", "auto", "_", "seventeen_letters", "Z"};
    for (std::size_t i = 0; i < names.size(); ++i) {
      nodes += R"(,{"name":")" + names[i] + R"(","mesh":0})";
      roots += "," + std::to_string(i + 1);
    }
    const std::string gltf =
        test::gltf(test::boxMesh(168) + R"(,"scenes":[{"nodes":[)" + roots + R"(]}],"nodes":[)" + nodes + "]");
    for (const char* name : {"x.prt", "text", "auto", "9a", "a-b", "_", "1", "seventeen_letters", "eighteen_letters__",
                             "Z", "standard", "unitless"})
      test::writeBytes(folder.file(name), gltf);
    return folder.file("s.json");
  }();
  return path;
}

/// Keys whose value makes another one wrong or missing, and where the parser then says so.
const std::map<std::string, std::string> kAccomplices = {{"/medium/phase/type", "/medium/phase"}};

/// Values that the schema takes and the parser does not, because their numbers depend on each other (scene_test.cpp).
bool isBeyondTheSchema(const std::string& pointer, const json& value) {
  if (pointer == "/import/camera" && value.is_string() && value != "" && value != "a\nb")
    return true;  // its cameras' names
  return pointer == "/camera/shutter" && value.is_array() && value.size() == 2 && value[0].is_number() &&
         value[1].is_number() && value[0].get<float>() > value[1].get<float>();
}

struct Verdict {
  bool accepted;
  std::string message;
};

Verdict parse(const json& scene) {
  try {
    parseScene(scene.dump(), sceneFile());
    return {true, {}};
  } catch (const InputError& error) {
    return {false, error.what()};
  }
}

/// The words that the parser says it expects at `pointer`: those of its enumerations.
std::vector<std::string> expectedWords(json scene, const std::string& pointer) {
  scene[Pointer(pointer)] = "no_such_word";
  const std::string message = parse(scene).message;
  const std::string expected = message.substr(0, message.rfind(", got "));
  const std::regex quoted("\"([a-zA-Z_]+)\"");
  std::vector<std::string> words;
  for (std::sregex_iterator match(expected.begin(), expected.end(), quoted), end; match != end; ++match)
    words.push_back((*match)[1]);
  return words;
}

/// Walks every object of the schema; `visit(property, pointer, base)` gets a scene in which all but the key is there.
class Walk {
 public:
  using Visit = std::function<void(const json& property, const std::string& pointer, const json& base)>;
  explicit Walk(Visit visit) : visit_(std::move(visit)) {
    object(schema(), "", "", {{"particles", {{{"file", "x.prt"}}}}});
  }
  const std::map<std::string, std::set<std::string>>& keys() const { return keys_; }

 private:
  void object(const json& node, const std::string& pointer, const std::string& generic, const json& base) {
    keys_[generic];
    for (const auto& [key, unresolved] : node["properties"].items()) {
      keys_[generic].insert(key);
      const json property = resolved(unresolved);
      const std::string at = pointer + "/" + key, genericAt = generic + "/" + key;
      visit_(property, at, base);
      inner(property, at, genericAt, base);
      if (property.contains("items")) inner(resolved(property["items"]), at + "/0", genericAt + "/*", base);
    }
  }

  void inner(const json& node, const std::string& at, const std::string& genericAt, json base) {
    for (const json& choice : node.value("oneOf", json::array())) inner(resolved(choice), at, genericAt, base);
    if (node.value("type", "") != "object") return;
    base[Pointer(at)] = leastObject(node);
    if (at == "/solids/0" && !node["properties"].contains("file"))
      base["import"] = "x.prt";  // it changes a solid of it
    object(node, at, genericAt, base);
  }

  Visit visit_;
  std::map<std::string, std::set<std::string>> keys_;
};

TEST(SceneSchema, HasOnlyKeywordsThatThisTestUnderstands) {
  const std::function<void(const json&)> check = [&](const json& node) {
    for (const auto& [keyword, value] : node.items()) {
      EXPECT_TRUE(kKeywords.contains(keyword)) << keyword;
      if (keyword == "properties" || keyword == "$defs")
        for (const json& child : value) check(child);
      if (keyword == "oneOf")
        for (const json& child : value) check(child);
      if (keyword == "items" || keyword == "not") check(value);
    }
  };
  check(schema());
}

TEST(SceneSchema, AcceptsAndRefusesAtEveryKeyWhatTheParserDoes) {
  std::size_t accepted = 0, refused = 0;
  Walk([&](const json& property, const std::string& pointer, const json& base) {
    json companions = kCompanions.contains(pointer) ? kCompanions.at(pointer) : json::object();
    std::vector<json> values = candidates(property);
    for (const std::string& word : expectedWords(base, pointer)) values.push_back(word);
    for (const json& value : values) {
      if (isBeyondTheSchema(pointer, value)) continue;
      json scene = base;
      for (const auto& [key, companion] : companions.items())
        scene[Pointer(pointer).parent_pointer() / key] = companion;
      scene[Pointer(pointer)] = value;
      const bool expected = accepts(schema(), scene);
      const Verdict verdict = parse(scene);
      ASSERT_EQ(verdict.accepted, expected) << pointer << " = " << value << "\n" << verdict.message;
      (expected ? accepted : refused) += 1;
      if (expected) continue;
      const auto names = [&](const std::string& at) {
        return verdict.message.find(": " + at + ": ") != std::string::npos ||
               verdict.message.find(": " + at + "/") != std::string::npos;
      };
      const bool named = names(pointer) || (kAccomplices.contains(pointer) && names(kAccomplices.at(pointer)));
      ASSERT_TRUE(named) << pointer << " = " << value << "\n" << verdict.message;
    }
  });
  // About 140 keys, those of both cameras and the three lights counted each; at least one good and twenty bad values
  // each.
  EXPECT_GT(accepted, 400u);
  EXPECT_GT(refused, 2600u);
}

TEST(SceneSchema, RefusesAnUnknownKeyInEveryObjectAsTheParserDoes) {
  Walk([](const json&, const std::string& pointer, const json& base) {
    json scene = base;
    const Pointer unknown = Pointer(pointer).parent_pointer() / "no_such_key";
    scene[unknown] = 1;
    EXPECT_FALSE(accepts(schema(), scene)) << scene;
    const Verdict verdict = parse(scene);
    EXPECT_FALSE(verdict.accepted) << scene;
    EXPECT_NE(verdict.message.find(unknown.to_string() + ": "), std::string::npos) << verdict.message;
  });
}

TEST(SceneSchema, RefusesAMissingRequiredKeyAsTheParserDoes) {
  EXPECT_FALSE(parse(json::object()).accepted);
  for (const json& source :
       {json{{"count", 3}}, json{{"generate", "ball"}}, json{{"file", "a"}, {"generate", "ball"}},
        json{{"file", "a"}, {"count", 0}}, json{{"generate", "ball"}, {"count", 1}, {"grid", "density"}},
        json{{"generate", "ball"}, {"count", 1}, {"channels", json::object()}}}) {
    const json scene = {{"particles", {source}}};
    EXPECT_FALSE(accepts(schema(), scene)) << scene;
    EXPECT_FALSE(parse(scene).accepted) << scene;
  }
}

TEST(SceneSchema, RefusesKeysThatExcludeEachOtherAsTheParserDoes) {
  const std::pair<const char*, json> excluding[] = {
      {"medium", {{"density_scale", 1}, {"optical_depth", 4}}},
      {"medium", {{"phase", {{"type", "rayleigh"}, {"g", 0.5}}}}},
      {"medium", {{"phase", {{"type", "henyey_greenstein"}}}}},
      {"lights", {{{"type", "directional"}, {"position", {1, 2, 3}}}}},
      {"lights", {{{"type", "point"}, {"target", {1, 2, 3}}}}},
      {"lights", {{{"type", "spot"}, {"direction", {1, 2, 3}}}}},
      {"lights", {{{"outer_angle", 30}}}},
      {"solids", {{{"mode", "hidden"}}}},
      {"camera", {{"height", 3}}},
      {"camera", {{"type", "orthographic"}, {"fov", 30}}},
      {"camera", {{"keys", {{{"frame", 1}, {"height", 3}}}}}},
      {"camera", {{"type", "orthographic"}, {"keys", {{{"frame", 1}, {"fov", 30}}}}}},
      {"camera", {{"keys", {{{"frame", 1}}}}}},
      {"camera", {{"keys", {{{"fov", 30}, {"focus_distance", 3}}}}}}};
  for (const auto& [key, value] : excluding) {
    const json scene = {{"particles", {{{"file", "x.prt"}}}}, {key, value}};
    EXPECT_FALSE(accepts(schema(), scene)) << scene;
    EXPECT_FALSE(parse(scene).accepted) << scene;
  }
}

TEST(SceneSchema, HasTheKeysThatTheParserAsksFor) {
  const Walk walk([](const json&, const std::string&, const json&) {});
  std::map<std::string, std::set<std::string>> known;
  for (const auto& [object, keys] : knownSceneKeys()) known[object] = {keys.begin(), keys.end()};
  EXPECT_EQ(walk.keys(), known);
}

TEST(SceneSchema, HasTheParsersDefaults) {
  // Without the words of it, and without whether it says that the range is its shot.
  const auto meaning = [](const json& text) {
    Scene scene = parseScene(text.dump(), sceneFile());
    scene.settings.clear(), scene.shot.reset();
    return scene;
  };
  std::size_t defaults = 0;
  Walk([&](const json& property, const std::string& pointer, const json& base) {
    if (!property.contains("default")) return;
    json scene = base;
    scene[Pointer(pointer)] = property["default"];
    ++defaults;
    EXPECT_EQ(meaning(scene), meaning(base)) << pointer;
  });
  EXPECT_GT(defaults, 60u);
}

TEST(SceneSchema, DescribesEveryKey) {
  Walk([](const json& property, const std::string& pointer, const json&) {
    EXPECT_FALSE(property.value("description", "").empty()) << pointer;
  });
}

TEST(SceneSchema, AcceptsTheScenesOfTheRepository) {
  std::set<std::string> names;
  for (const char* folder : {MOTE_SOURCE_DIR "/scenes", MOTE_SOURCE_DIR "/scenes/gallery"})
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::filesystem::path& path = entry.path();
      if (path.extension() != ".json" || path.filename() == "scene.schema.json") continue;
      names.insert(path.stem());
      std::ifstream file(path);
      EXPECT_TRUE(accepts(schema(), json::parse(file, nullptr, true, true))) << path;
      EXPECT_NO_THROW(readScene(path)) << path;
    }
  for (const char* name : {"plume", "cloud", "ball", "import", "lens", "louvre", "ground", "smoke1"})
    EXPECT_TRUE(names.contains(name)) << name;
}

}  // namespace
}  // namespace mote
