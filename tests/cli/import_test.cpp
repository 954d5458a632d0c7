// A shot that is imported and one that is written out give the same picture, to the bit.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "tests/cli/mote_program.h"
#include "tests/support/gltf.h"

namespace mote::test {
namespace {

/// A camera on the z axis, a lamp, and a box of half the size beside the ball; all places are exact in a float.
std::string shot() {
  return glb(gltf(R"("cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.25,"zfar":64}}],)"
                  R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","color":[1,0.5,0.25],)"
                  R"("intensity":40980}]}},)" +
                  boxMesh(168) +
                  R"(,"scenes":[{"nodes":[0,1,2]}],"nodes":[{"camera":0,"translation":[0,0,6]},{"name":"lamp",)"
                  R"("extensions":{"KHR_lights_punctual":{"light":0}},"translation":[2,3,1]},)"
                  R"({"name":"box","mesh":0,"translation":[1,-0.5,0.25],"scale":[0.5,0.5,0.5]}])"),
             boxBytes());
}

/// That box as OBJ.
std::string boxObj() {
  std::string text;
  for (const float x : {0.5f, 1.5f})
    for (const float y : {-1.0f, 0.0f})
      for (const float z : {-0.25f, 0.75f}) text += fmt::format("v {} {} {}\n", x, y, z);
  std::vector<std::uint16_t> indices(36);
  std::memcpy(indices.data(), boxBytes().data() + 96, 72);
  for (std::size_t i = 0; i < indices.size(); i += 3)
    text += fmt::format("f {} {} {}\n", indices[i] + 1, indices[i + 1] + 1, indices[i + 2] + 1);
  return text;
}

std::string scene(const std::string& keys) {
  return R"({"particles":[{"generate":"ball","count":2000,"seed":4}],"output":{"size":[96,64],"precision":"float"},)" +
         keys + "}";
}

void render(const TempFolder& folder, const std::string& name) {
  const ProcessResult result = mote({"render", folder.file(name + ".json"), "--lighting", "cpu", "--raster", "cpu",
                                     "-o", folder.file(name + ".exr"), "--stats", folder.file(name + ".stats.json")},
                                    kWithoutVulkan);
  EXPECT_EQ(result.exitCode, 0) << result.err;
}

TEST(Import, GivesThePictureOfTheSameSceneWrittenOut) {
  const TempFolder folder;
  writeBytes(folder.file("shot.glb"), shot());
  writeBytes(folder.file("box.obj"), boxObj());
  writeBytes(folder.file("imported.json"),
             scene(R"("import":"shot.glb","solids":[{"name":"box","albedo":[1,0.5,0.5]}])"));
  writeBytes(folder.file("written.json"),
             scene(fmt::format(R"("camera":{{"position":[0,0,6],"target":[0,0,0],"fov":{},"near":0.25,"far":64}},)"
                               R"("lights":[{{"name":"lamp","position":[2,3,1],"color":[1,0.5,0.25],"intensity":60}}],)"
                               R"("solids":[{{"name":"box","file":"box.obj","albedo":[1,0.5,0.5]}}])",
                               static_cast<float>(glm::degrees(0.5)))));
  render(folder, "imported");
  render(folder, "written");
  const Image imported = readExr(folder.file("imported.exr")), written = readExr(folder.file("written.exr"));
  ASSERT_EQ(imported.pixels.size(), 96u * 64);
  EXPECT_EQ(imported.pixels, written.pixels);
  // Neither is empty: there is light, and the box stands before the ball's background.
  float most = 0;
  for (const vec4& pixel : imported.pixels) most = std::max(most, pixel.x);
  EXPECT_GT(most, 0.01f);
}

TEST(Import, CountsAmongTheInputs) {
  const TempFolder folder;
  writeBytes(folder.file("shot.glb"), shot());
  writeBytes(folder.file("imported.json"), scene(R"("import":"shot.glb")"));
  render(folder, "imported");
  const auto stats = nlohmann::json::parse(readBytes(folder.file("imported.stats.json")));
  const auto& inputs = stats["frames"][0]["inputs"];
  ASSERT_EQ(inputs.size(), 1u);  // read for the scene and for its mesh, told once
  EXPECT_EQ(inputs[0]["file"], folder.file("shot.glb"));
  EXPECT_EQ(inputs[0]["sha256"].get<std::string>().size(), 64u);
}

TEST(Import, OfABrokenFileSaysWhereAndLeavesNothing) {
  const TempFolder folder;
  writeBytes(folder.file("shot.glb"), shot().substr(0, 700));
  writeBytes(folder.file("imported.json"), scene(R"("import":"shot.glb")"));
  const ProcessResult result =
      mote({"render", folder.file("imported.json"), "-o", folder.file("x.exr")}, kWithoutVulkan);
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, "shot.glb: expected "));
  EXPECT_TRUE(contains(result.err, "the file is cut short"));
  EXPECT_EQ(folder.entries().size(), 2u);
}

}  // namespace
}  // namespace mote::test
