// Houdini's GEO and BGEO (JSON): what the reader accepts and refuses. Files are put together here as text, and encoded
// in binary from that.
#include "host/particles/formats/houdini_reader.h"

#include <blosc.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "host/particles/particle_loader.h"
#include "tests/support/gzipped.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;
using Json = nlohmann::ordered_json;

// ---- binary JSON ----

std::string length(std::uint64_t n) {
  if (n < 0xf1) return std::string(1, static_cast<char>(n));
  return "\xf4" + rawNumbers<std::uint32_t>({static_cast<std::uint32_t>(n)});
}
template <class T>
std::string scalar(char token, T value) {
  return token + rawNumbers<T>({value});
}

/// Lists of numbers or bools of one kind as arrays of one type, where `uniform`.
std::string uniformList(const Json& list) {
  const auto all = [&](auto&& is) { return !list.empty() && std::all_of(list.begin(), list.end(), is); };
  std::string data;
  if (all([](const Json& j) { return j.is_boolean(); })) {
    for (std::size_t k = 0; k < list.size(); k += 32) {
      std::uint32_t word = 0;
      for (std::size_t b = 0; b < 32 && k + b < list.size(); ++b) word |= std::uint32_t{list[k + b].get<bool>()} << b;
      data += rawNumbers<std::uint32_t>({word});
    }
    return "\x40\x10" + length(list.size()) + data;
  }
  if (all([](const Json& j) { return j.is_number_integer(); })) {
    for (const Json& j : list) data += rawNumbers<std::int32_t>({j.get<std::int32_t>()});
    return "\x40\x13" + length(list.size()) + data;
  }
  if (all([](const Json& j) { return j.is_number(); })) {
    for (const Json& j : list) data += rawNumbers<float>({j.get<float>()});
    return "\x40\x19" + length(list.size()) + data;
  }
  return "";
}

class Encoder {
 public:
  explicit Encoder(bool uniform) : uniform_(uniform) {}
  std::string encode(const Json& json) {
    if (json.is_boolean()) return json.get<bool>() ? "1" : "0";
    if (json.is_number_integer()) return scalar('\x13', json.get<std::int32_t>());
    if (json.is_number()) return scalar('\x1a', json.get<double>());
    if (json.is_string()) return text(json.get<std::string>());
    if (json.is_null()) return std::string(1, '\0');
    if (uniform_)
      if (const std::string list = uniformList(json); !list.empty()) return list;
    std::string bytes(1, json.is_array() ? '[' : '{');
    for (const auto& [key, value] : json.items()) {
      if (json.is_object()) bytes += text(key);
      bytes += encode(value);
    }
    return bytes + (json.is_array() ? ']' : '}');
  }

 private:
  /// Defined where it first stands, then referred to; short ones as they are.
  std::string text(const std::string& value) {
    if (value.size() < 3) return "\x27" + length(value.size()) + value;
    const auto [found, isNew] = ids_.try_emplace(value, ids_.size());
    const std::string id = length(found->second);
    return (isNew ? "\x2b" + id + length(value.size()) + value : "") + "\x26" + id;
  }
  bool uniform_;
  std::map<std::string, std::size_t> ids_;
};

std::string binary(const std::string& geo, bool uniform = true) {
  return "\x7fNSJb" + Encoder(uniform).encode(Json::parse(geo));
}

/// In blocks, as Houdini's .sc has them.
std::string scf(const std::string& bytes, std::size_t blockBytes = 100) {
  std::string blocks, index;
  const auto bigEndian = [](std::uint64_t value) { return rawNumbers<std::uint64_t>({value}, true); };
  for (std::size_t k = 0; k < bytes.size(); k += blockBytes) {
    const std::string part = bytes.substr(k, blockBytes);
    std::string packed(part.size() + BLOSC_MAX_OVERHEAD, '\0');
    const int size = blosc_compress_ctx(5, 1, 4, part.size(), part.data(), packed.data(), packed.size(), "lz4", 0, 1);
    EXPECT_GT(size, 0);
    blocks += packed.substr(0, static_cast<std::size_t>(size));
    if (k + blockBytes < bytes.size()) index += bigEndian(blocks.size());
  }
  index += bigEndian(blockBytes) + bigEndian(bytes.size() % blockBytes);
  return "scf1" + bigEndian(0) + blocks + index + bigEndian(index.size()) + "1fcs";
}

// ---- geometry ----

std::string attribute(const std::string& name, const std::string& values, const std::string& type = "numeric") {
  return R"([["scope","public","type",")" + type + R"(","name",")" + name +
         R"(","options",{"type":{"type":"string","value":"x]"}}],["size",1,"storage","fpreal32","defaults",)" +
         R"(["size",1,"storage","fpreal64","values",[0]],"values",[)" + values + "]]]";
}
std::string values(int size, const char* storage, const std::string& rest) {
  return "\"size\"," + std::to_string(size) + ",\"storage\",\"" + storage + "\"," + rest;
}
std::string geo(int points, const std::vector<std::string>& attributes, const std::string& globals = "") {
  std::string list;
  for (const std::string& a : attributes) list += (list.empty() ? "" : ",") + a;
  return R"(["fileversion","18.5.1","hasindex",false,"pointcount",)" + std::to_string(points) +
         R"(,"vertexcount",0,"info",{"software":"Houdini 18.5.1","bounds":[1,2],"date":"today"},)" +
         R"("topology",["pointref",["indices",[0,1,[]]]],"attributes",["vertexattributes",[[]],"pointattributes",[)" +
         list + R"(],"globalattributes",[)" + globals + R"(]],"primitives",[[["type","run"],{"a":[1,"[{"]}]]])";
}

/// Two points: a place in tuples, an id in an array, a colour in pages, a text.
std::string twoPoints() {
  return geo(2, {attribute("P", values(3, "fpreal32", R"("tuples",[[1,2,3],[4,5.5,6]])")),
                 attribute("id", values(1, "int64", R"("arrays",[[7,9007199254740993]])")),
                 attribute("Cd", values(3, "fpreal16", R"("pagesize",1024,"rawpagedata",[0.5,0.25,1,0.5,0.25,4])")),
                 R"([["scope","public","type","string","name","shop"],["size",1,"storage","int32","strings",["a"]]])"});
}
std::string twoSmallPoints() {  // without a number that needs more than 32 bits
  std::string file = twoPoints();
  return file.replace(file.find("9007199254740993"), 16, "9");
}

/// As little as has tuples, pages with parts and constants, and a global.
std::string smallGeometry() {
  return R"(["fileversion","9","pointcount",2,"attributes",["pointattributes",[[["type","numeric","name","P"],)"
         R"(["values",["size",3,"storage","fpreal32","tuples",[[1,2,3],[4,5.5,6]]]]],)"
         R"([["type","numeric","name","C"],["values",["size",2,"storage","int8","pagesize",2,"packing",[1,1],)"
         R"("constantpageflags",[[true],[false]],"rawpagedata",[1,2,3]]]]]]])";
}

/// The same geometry in every way that is read.
std::vector<std::string> everyEncoding(const std::string& file) {
  return {file, gzipped(file), scf(file), binary(file), binary(file, false), gzipped(binary(file)), scf(binary(file))};
}

TEST(HoudiniReader, ReadsTuplesArraysAndPagesInEveryEncoding) {
  for (const std::string& file : everyEncoding(twoSmallPoints())) {
    const OpenedFile opened(file);
    EXPECT_EQ(opened.file->format().find("Houdini 18.5.1 ("), 0u) << opened.file->format();
    EXPECT_EQ(describeChannels(opened.file->channels()), "P (3 × float32), id (int64), Cd (3 × float16)");
    for (int again = 0; again < 2; ++again) {
      EXPECT_EQ(opened.read<vec3>("P"), (std::vector<vec3>{{1, 2, 3}, {4, 5.5, 6}}));
      EXPECT_EQ(opened.read<std::uint64_t>("id"), (std::vector<std::uint64_t>{7, 9}));
      EXPECT_EQ(opened.read<vec3>("Cd"), (std::vector<vec3>{{0.5f, 0.25f, 1}, {0.5f, 0.25f, 4}}));
    }
    EXPECT_EQ(opened.file->meta("", "software")->bytes, "Houdini 18.5.1");
  }
  EXPECT_EQ(OpenedFile(twoSmallPoints()).file->format(), "Houdini 18.5.1 (JSON)");
  EXPECT_EQ(OpenedFile(scf(binary(twoSmallPoints()))).file->format(), "Houdini 18.5.1 (binary JSON, Blosc)");
  EXPECT_EQ(OpenedFile(twoPoints()).read<std::uint64_t>("id")[1], 9007199254740993u);
}

TEST(HoudiniReader, ReadsPagesWithPartsAndConstants) {
  // Pages of two points: parts of 1 and 2 numbers; the first is constant on pages 0 and 2, the second on page 1.
  const std::string mixed =
      values(3, "int32",
             R"("pagesize",2,"packing",[1,2],"constantpageflags",[[true,false,true],[false,true,false]],)"
             R"("rawpagedata",[10, 20,30,21,31, 12,13, 22,32, 14, 24,34])");
  const std::string varying =
      values(1, "fpreal64", R"("pagesize",2,"packing",[1],"constantpageflags",[[]],"rawpagedata",[1,2,3,4,5.5])");
  const std::string constant = values(1, "int8", R"("pagesize",8,"constantpageflags",[[1]],"rawpagedata",[-3])");
  const std::string columns = values(2, "fpreal32", R"("arrays",[[1,2,3,4,5],[6,7,8,9,10]])");
  for (const std::string& file : everyEncoding(geo(
           5, {attribute("P", mixed), attribute("w", varying), attribute("c", constant), attribute("uv", columns)}))) {
    const OpenedFile opened(file);
    EXPECT_EQ(opened.read<vec3>("P"),
              (std::vector<vec3>{{10, 20, 30}, {10, 21, 31}, {12, 22, 32}, {13, 22, 32}, {14, 24, 34}}));
    EXPECT_EQ(opened.read<float>("w"), (std::vector<float>{1, 2, 3, 4, 5.5}));
    EXPECT_EQ(opened.read<float>("c"), (std::vector<float>(5, -3)));
    std::vector<std::byte> raw = opened.read<std::byte>("uv");
    const std::string expected = rawNumbers<float>({1, 6, 2, 7, 3, 8, 4, 9, 5, 10});
    EXPECT_EQ(std::memcmp(raw.data(), expected.data(), expected.size()), 0);
  }
}

TEST(HoudiniReader, ReadsAMapAsWellAsAListAndGlobalsAsMetadata) {
  const std::string globals = attribute("time", values(1, "fpreal64", R"("arrays",[[1.5]])")) + "," +
                              attribute("res", values(3, "int32", R"("tuples",[[1,2,3]])")) +
                              R"(,[["scope","public","type","string","name","note"],["size",1,"storage","int32",)" +
                              R"("strings",["hello"],"indices",["size",1,"storage","int32","arrays",[[0]]]]])";
  const OpenedFile opened(geo(1, {attribute("P", values(3, "fpreal32", R"("tuples",[[1,2,3]])"))}, globals));
  EXPECT_EQ(opened.file->meta("", "time")->bytes, rawNumbers<double>({1.5}));
  EXPECT_EQ(opened.file->meta("", "res")->bytes, rawNumbers<std::int32_t>({1, 2, 3}));
  EXPECT_EQ(opened.file->meta("", "note")->bytes, "hello");
  EXPECT_EQ(opened.file->channels().size(), 1u);

  const std::string map = R"({"fileversion":"12","pointcount":1,"attributes":["pointattributes",[)" +
                          attribute("P", values(3, "fpreal32", R"("tuples",[[1,2,3]])")) + "]]}";
  for (const std::string& file : {map, binary(map)})
    EXPECT_EQ(OpenedFile(file).read<vec3>("P"), (std::vector<vec3>{{1, 2, 3}}));
}

TEST(HoudiniReader, ReadsTextAndBinaryOfARealFileAlike) {
  ParticleSource source;
  source.radius.kind = RadiusRule::Kind::Number, source.radius.value = 1;
  const auto load = [&](const char* name) {
    source.file = sharedFile(std::string("houdini_json/simple_partanim_16_5.") + name);
    return loadParticles({source}, 1);
  };
  const ParticleSet text = load("geo"), binary = load("bgeo");
  ASSERT_EQ(text.size(), 10u);
  EXPECT_EQ(text.position, binary.position);
  EXPECT_EQ(text.velocity, binary.velocity);
  EXPECT_EQ(text.id, binary.id);
  EXPECT_EQ(text.id[9], 9u);
  EXPECT_FLOAT_EQ(text.position[0].x, 7.52561378f);
  EXPECT_FLOAT_EQ(text.velocity[9].y, -1.27064133f);
  const Bounds bounds = text.bounds();  // as its PROVENANCE has them
  EXPECT_NEAR(bounds.lo.x, -12.048, 1e-3);
  EXPECT_NEAR(bounds.hi.z, 14.964, 1e-3);

  const auto opened = openParticleFile(sharedFile("houdini_json/simple_partanim_16_5.bgeo"));
  EXPECT_EQ(opened->format(), "Houdini 16.5.268 (binary JSON)");
  EXPECT_EQ(opened->channels().size(), 13u);
  EXPECT_EQ(opened->meta("", "nextid")->bytes, rawNumbers<std::int32_t>({10}));
  for (const Channel& channel : opened->channels()) {  // constant pages among them
    const auto raw = [&](const char* name) {
      std::vector<std::byte> bytes;
      const ChannelRequest request{channel.name, &bytes};
      openParticleFile(sharedFile(std::string("houdini_json/simple_partanim_16_5.") + name))->read({&request, 1});
      return bytes;
    };
    EXPECT_EQ(raw("geo"), raw("bgeo")) << channel.name;
  }
}

TEST(HoudiniReader, ReadsAFileWithoutPoints) {
  const auto empty = openParticleFile(sharedFile("houdini_json/empty_16_5.bgeo"));
  EXPECT_EQ(empty->count(), 0u);
  EXPECT_TRUE(empty->channel("P"));
  std::vector<vec3> values{vec3(1)};
  const ChannelRequest request{"P", &values};
  empty->read({&request, 1});
  EXPECT_TRUE(values.empty());
}

TEST(HoudiniReader, RefusesTruncationAtEveryByte) {
  const std::string small = smallGeometry();
  for (const std::string& whole : {small, binary(small), binary(small, false), scf(binary(small))}) {
    EXPECT_NO_THROW(OpenedFile(whole).readAll());
    for (std::size_t size = 0; size < whole.size(); ++size) expectFileRefused(whole.substr(0, size), {"particles"});
  }
}

TEST(HoudiniReader, SurvivesEveryFlippedBit) {
  // No more points than deflate could make of these bytes, were they of one byte each.
  const std::string small = smallGeometry();
  for (const std::string& whole : {small, binary(small), scf(binary(small))})
    expectEveryFlippedBitSurvived(whole, 1032 * whole.size());
}

TEST(HoudiniReader, RefusesHostileNumbersWithoutAllocating) {
  const std::string one = attribute("P", values(1, "fpreal32", R"("arrays",[[1]])"));
  for (const char* points : {"-1", "2147483647", "9223372036854775807", "1e300", "\"2\"", "null"}) {
    std::string file = geo(1, {one});
    file.replace(file.find("\"pointcount\",1") + 13, 1, points);
    expectFileRefused(file, {"particles"});
  }
  const auto refused = [](const std::string& numbers, const std::vector<std::string>& words, int points = 2) {
    expectFileRefused(geo(points, {attribute("P", numbers)}), words);
  };
  refused(values(1, "fpreal32", R"("pagesize",4611686018427387904,"rawpagedata",[1,2])"), {"pagesize"});
  refused(values(1, "fpreal32", R"("pagesize",0,"rawpagedata",[1,2])"), {"pagesize", "got 0"});
  refused(R"("size",9223372036854775807,"storage","int8","arrays",[[1]])", {"size", "1 to 1024"});
  refused(values(3, "fpreal32", R"("pagesize",8,"packing",[9223372036854775807,3],"rawpagedata",[])"), {"packing"});
  refused(values(3, "fpreal32", R"("pagesize",8,"packing",[1,1],"rawpagedata",[])"), {"packing", "3 numbers in all"});
  refused(values(3, "fpreal32", R"("pagesize",1,"constantpageflags",[[1]],"rawpagedata",[])"),
          {"constantpageflags", "2"});
  refused(values(3, "fpreal32", R"("pagesize",8,"constantpageflags",[[1],[1]],"rawpagedata",[])"), {"1 lists"});
  // A million million points of one constant page each.
  std::string bomb = geo(
      1, {attribute("P", values(3, "fpreal32", R"("pagesize",1024,"constantpageflags",[[1]],"rawpagedata",[1,2,3])"))});
  bomb.replace(bomb.find("\"pointcount\",1") + 13, 1, "1000000000000");
  expectFileRefused(bomb, {"point attribute 'P'", "1000000000000 points"});
  // Deep nests, and lengths that no file has.
  expectFileRefused("[\"fileversion\"," + std::string(100000, '['), {"particles"});
  std::string deep = "\x7fNSJb[\x27\x0b";
  deep += "fileversion" + std::string(100000, '[');
  expectFileRefused(deep, {"deeper"});
  std::string start = "\x7fNSJb[\x27\x0b";
  start += "fileversion";
  for (const char* length :
       {"\xf8\xff\xff\xff\xff\xff\xff\xff\xff", "\xf8\xff\xff\xff\xff\xff\xff\xff\x3f", "\xf4\xff\xff\xff\xff"})
    for (const char* token : {"\x27", "\x2b\x01", "\x40\x1a", "\x40\x10", "\x40\x27"})
      expectFileRefused(start + token + std::string(length), {"binary JSON"});
  expectFileRefused(start + "\x26\x05", {"defined before", "number 5"});
}

TEST(HoudiniReader, RefusesShortFilesOfEndlessNumbers) {
  // Attributes that are each no more than such a file could hold, of one constant page, but not all together.
  const std::string constant =
      values(1, "fpreal64", R"("pagesize",1000000,"constantpageflags",[[1]],"rawpagedata",[1])");
  std::vector<std::string> attributes;
  for (const char* name : {"a", "b", "c"}) attributes.push_back(attribute(name, constant));
  const std::size_t bytes = geo(100000, attributes).size();
  const int points = static_cast<int>(bytes * 1032 / 8 * 2 / 5);  // two fit, three do not
  EXPECT_EQ(OpenedFile(geo(points, {attributes[0]}) + std::string(bytes, ' ')).file->count(), std::size_t(points));
  expectFileRefused(geo(points, attributes), {"point attribute 'c'", "for what is left"});
  // No numbers at all, so that nothing contradicts their number.
  expectFileRefused(geo(2147483647, {}), {"pointattributes", "2147483647 points", "none"});
  // Lists in a global attribute's numbers, one byte each.
  expectFileRefused(geo(0, {}, attribute("g", values(1, "fpreal32", "\"arrays\"," + std::string(1000, '[')))),
                    {"deep at most"});
}

TEST(HoudiniReader, TakesALongTextThatIsReferredToAgainAndAgain) {
  // 1 MB, 200,000 times: nobody could wait for them all to be copied.
  constexpr std::uint32_t kLong = 1 << 20, kTimes = 200000;
  const std::string text(kLong, 'x');
  std::string file = "\x7fNSJb[\x27\x0b";
  file += "fileversion\x27\x01";
  file += "9\x27\x0apointcount\x11";
  file += std::string(1, '\0') + "\x2b\x01\xf4" + rawNumbers<std::uint32_t>({kLong}) + text;
  for (std::uint32_t k = 0; k < kTimes; ++k) file += "\x26\x01";
  EXPECT_EQ(OpenedFile(file + "]").file->count(), 0u);
}

TEST(HoudiniReader, RefusesPackedBombs) {
  // Blocks of zeros that unpack to more than deflate could make of them, and a block that is larger than any.
  const std::string zeros(1 << 22, '\0');
  std::string block(4096, '\0');
  const int size = blosc_compress_ctx(9, 1, 8, zeros.size(), zeros.data(), block.data(), block.size(), "zstd", 0, 1);
  if (size > 0 && zeros.size() / static_cast<std::size_t>(size) > 1032) {
    block.resize(static_cast<std::size_t>(size));
    std::string file = "scf1" + std::string(8, '\0');
    for (int k = 0; k < 10; ++k) file += block;
    expectFileRefused(file + std::string(8, '\0') + "1fcs", {"Blosc block", "unpacked to"});
  }
  std::string packed = scf(binary(twoSmallPoints()));
  packed.replace(12 + 4, 4, "\xff\xff\xff\x7f");
  expectFileRefused(packed, {"Blosc block at byte 12", "2147483647"});
}

TEST(HoudiniReader, SaysWhatIsWrong) {
  const auto refused = [](const std::string& numbers, const std::vector<std::string>& words) {
    const std::string file = geo(2, {attribute("P", numbers)});
    expectFileRefused(file, words);
    expectFileRefused(binary(file), words);
  };
  refused(values(3, "fpreal32", R"("tuples",[[1,2,3]])"),
          {"point attribute 'P', point 1", "2 points", "the array's end"});
  refused(values(3, "fpreal32", R"("tuples",[[1,2,3],[4,5,6],[7,8,9]])"), {"numbers of 2 points", "more"});
  refused(values(3, "fpreal32", R"("tuples",[[1,2],[3,4,5,6]])"), {"lists of 3 numbers", "got 2"});
  refused(values(2, "fpreal32", R"("arrays",[[1],[2,3,4]])"), {"lists of 2 numbers", "got 1"});
  refused(values(1, "fpreal32", R"("arrays",[["a","b"]])"), {"point attribute 'P', point 0", "'a'"});
  refused(values(1, "fpreal8", R"("arrays",[[1,2]])"), {"storage", "'fpreal8'"});
  refused(values(1, "int8", R"("nothing",[[1,2]])"), {"values", "tuples, arrays or rawpagedata"});
  refused(values(1, "int8", R"("arrays",[[1,2]],"tuples",[[1],[2]])"), {"attribute 'P'", "twice"});
  const std::string p = attribute("P", values(1, "int8", R"("arrays",[[1,2]])"));
  expectFileRefused(geo(2, {p, p}), {"'P' twice"});
  expectFileRefused(R"(["fileversion","1","nothing",[]])", {"pointcount", "none"});
  expectFileRefused(R"(["fileversion","1",},1])", {"JSON, byte 20", "valid JSON"});
  expectFileRefused(R"(["fileversion","1")", {"the file is cut off"});
  expectFileRefused(scf("some other file, packed by Houdini"), {"Houdini geometry", "Blosc"});
  std::string damaged = scf(binary(twoSmallPoints()));
  damaged.replace(damaged.size() - 4, 4, "xxxx");
  expectFileRefused(damaged, {"1fcs", ".bgeo instead of .bgeo.sc"});
}

}  // namespace
}  // namespace mote
