// "import": a shot from a glTF file, and what the scene may change of it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/scene/camera_path.h"
#include "host/scene/scene_reader.h"
#include "host/solids/mesh.h"
#include "tests/support/gltf_shot.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

// --- what is taken ------------------------------------------------------------------------------------------------

TEST(GltfImport, PlacesAPerspectiveCameraByItsNodesWithoutTheirScale) {
  const Shot shot(wholeShot());
  const Camera camera = shot.scene().camera;
  EXPECT_EQ(camera.projection, Projection::Perspective);
  expectNear(camera.position, {11, 2, 3});  // 5 along z, twice as far, turned to x
  expectNear(viewOf(camera), {-1, 0, 0});
  expectNear(camera.up, {0, 1, 0});
  EXPECT_NEAR(static_cast<double>(camera.fov), 0.7 * 180 / kPi, 1e-5);  // yfov: Mote's is vertical too
  EXPECT_EQ(camera.near, 0.25f);
  EXPECT_EQ(camera.far, 64);
  EXPECT_FALSE(camera.fitted || camera.fittedDepths || camera.fittedHeight);
  EXPECT_TRUE(camera.keys.empty());
  EXPECT_EQ(shot.scene().imported, std::vector{shot.file("shot.glb")});
}

TEST(GltfImport, ReadsAnOrthographicCamera) {
  const Camera camera =
      Shot(gltf(kLens + R"("scenes":[{"nodes":[0]}],"nodes":[{"camera":1,"translation":[0,0,7]}])")).scene().camera;
  EXPECT_EQ(camera.projection, Projection::Orthographic);
  EXPECT_EQ(camera.height, 4);  // ymag is half of it
  EXPECT_EQ(camera.position, dvec3(0, 0, 7));
  EXPECT_EQ(camera.target, dvec3(0));
  EXPECT_EQ(camera.near, 0.5f);
  EXPECT_EQ(camera.far, 32);
}

TEST(GltfImport, LetsACameraWithoutZfarSeeForEver) {
  const Shot shot(gltf(R"("cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.5}}],)"
                       R"("scenes":[{"nodes":[0]}],"nodes":[{"camera":0}])"));
  EXPECT_EQ(shot.scene().camera.far, 1e18f);
}

TEST(GltfImport, TakesLightsOfAllKindsInRadiometricUnits) {
  const Scene scene = Shot(wholeShot()).scene();
  EXPECT_FALSE(scene.defaultLights);
  ASSERT_EQ(scene.lights.size(), 3u);
  const LightSource &point = scene.lights[0], &spot = scene.lights[1], &sun = scene.lights[2];
  EXPECT_EQ(point.name, "Key_Light");
  EXPECT_EQ(point.type, LightType::Point);
  EXPECT_EQ(point.position, dvec3(1, 2, 3));
  EXPECT_EQ(point.color, vec3(1, 0.5f, 0.25f));
  EXPECT_EQ(point.strength, 2);  // 1366 cd
  EXPECT_EQ(point.decay, 2);
  EXPECT_EQ(spot.name, "bulb");  // the node has no name, the light itself has
  EXPECT_EQ(spot.type, LightType::Spot);
  EXPECT_EQ(spot.position, dvec3(0, 4, 0));
  expectNear(spot.direction, {0, -1, 0});
  EXPECT_EQ(spot.strength, 1);
  EXPECT_NEAR(static_cast<double>(spot.innerAngle), 0.25 * 180 / kPi, 1e-5);
  EXPECT_NEAR(static_cast<double>(spot.outerAngle), 0.5 * 180 / kPi, 1e-5);
  EXPECT_EQ(sun.name, "Sun");
  EXPECT_EQ(sun.type, LightType::Directional);
  expectNear(sun.direction, {0, 0, -1});
  EXPECT_EQ(sun.strength, 0.5f);  // 341.5 lx
  EXPECT_EQ(Shot(wholeShot()).scene(R"(,"light_units":"unitless")").lights[0].strength, 1366);
}

TEST(GltfImport, PutsEachMeshWhereItsNodesDo) {
  const Scene scene = Shot(wholeShot()).scene();
  ASSERT_EQ(scene.solids.size(), 2u);
  EXPECT_EQ(scene.solids[0].name, "Box_001");
  EXPECT_EQ(scene.solids[1].name, "Box_001_2");
  const std::vector<Mesh> meshes = [&] {
    const Shot shot(wholeShot());
    return meshesOf(shot.scene());
  }();
  ASSERT_EQ(meshes.size(), 2u);
  for (const Mesh& mesh : meshes) EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(meshes[0].bounds().lo, vec3(-2, 9, -1));
  EXPECT_EQ(meshes[0].bounds().hi, vec3(2, 11, 1));
  EXPECT_EQ(meshes[1].bounds().lo, vec3(0, 9, -1));  // its 1 along x becomes 2
  EXPECT_EQ(meshes[1].bounds().hi, vec3(4, 11, 1));
}

TEST(GltfImport, FindsMeshesUnderASingleRootAndAmongNodesOutsideTheScene) {
  const Shot shot(
      glb(gltf(boxMesh(168) + R"(,"scene":1,"scenes":[{"nodes":[0]},{"nodes":[2]}],"nodes":[)"
                              R"({"name":"elsewhere","mesh":0},{"name":"b","mesh":0,"translation":[0,0,3]},)"
                              R"({"name":"top","children":[4,1,3]},{"name":"empty"},)"
                              R"({"name":"a","mesh":0,"translation":[5,0,0],"children":[5]},{"name":"c"}])"),
          boxBytes()));
  const Scene scene = shot.scene();
  ASSERT_EQ(scene.solids.size(), 2u);
  EXPECT_EQ(scene.solids[0].name, "a");
  EXPECT_EQ(scene.solids[1].name, "b");
  const std::vector<Mesh> meshes = meshesOf(scene);
  EXPECT_EQ(meshes[0].bounds().lo, vec3(4, -1, -1));
  EXPECT_EQ(meshes[1].bounds().lo, vec3(-1, -1, 2));
}

TEST(GltfImport, TakesTheFirstMaterialsBaseColourAsAlbedo) {
  std::string json =
      gltf(boxMesh(168) + R"(,"materials":[{},{"pbrMetallicRoughness":{"baseColorFactor":[0.25,0.5,2,1]}}],)"
                          R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}])");
  const std::string indices = R"("indices":1)";
  EXPECT_EQ(Shot(glb(json, boxBytes())).scene().solids[0].albedo, vec3(0.5f));
  json.replace(json.find(indices), indices.size(), indices + R"(,"material":1)");
  EXPECT_EQ(Shot(glb(json, boxBytes())).scene().solids[0].albedo, vec3(0.25f, 0.5f, 1));
}

TEST(GltfImport, TakesOnlyWhatIsAskedFor) {
  const Shot shot(wholeShot());
  EXPECT_TRUE(shot.scene(R"(,"camera":false)").camera.fitted);
  const Scene dark = shot.scene(R"(,"lights":false)");
  EXPECT_TRUE(dark.lights.empty() && dark.defaultLights);
  EXPECT_TRUE(shot.scene(R"(,"solids":false)").solids.empty());
  const Scene none = shot.scene(R"(,"camera":false,"lights":false,"solids":false)");
  EXPECT_TRUE(none.camera.fitted && none.lights.empty() && none.solids.empty());
  // The short way to say all of it.
  Scene all = parseScene(R"({"particles":[{"file":"x.prt"}],"import":"shot.glb"})", shot.file("scene.json"));
  all.settings = shot.scene().settings;  // the words differ
  EXPECT_EQ(all, shot.scene());
}

TEST(GltfImport, TakesTheFirstCameraOrTheNamedOne) {
  const Shot shot(gltf(kLens +
                       R"("scenes":[{"nodes":[1,0,2]}],"nodes":[{"name":"Top","camera":0,"translation":[0,9,0]},)"
                       R"({"name":"Side","camera":1},{"name":"Old","children":[3],"translation":[0,0,2]},)"
                       R"({"name":"Old_Orientation","camera":0}])"));
  std::vector<std::string> warnings;
  {
    const WarningsKept kept(warnings);
    EXPECT_EQ(shot.scene().camera.projection, Projection::Orthographic);
    EXPECT_EQ(shot.scene(R"(,"camera":"Top")").camera.position, dvec3(0, 9, 0));
    EXPECT_EQ(shot.scene(R"(,"camera":"lens")").camera.position, dvec3(0, 9, 0));  // the camera's own name
    EXPECT_EQ(shot.scene(R"(,"camera":"Old")").camera.position, dvec3(0, 0, 2));   // as Blender called it
  }
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(contains(warnings[0], R"(of its 3 cameras ("Side", "Top", "Old") the first is taken)"));
  EXPECT_TRUE(contains(shot.error(R"(,"camera":"Front")"),
                       R"(shot.glb: expected a camera "Front" in its scene, got "Side", "Top", "Old")"));
}

TEST(GltfImport, ReadsTheDuckOfTheSharedData) {
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  const Scene scene = parseScene(
      fmt::format(R"({{"particles":[{{"file":"x.prt"}}],"import":"{}"}})", test::sharedFile("mesh/Duck.glb")),
      "s.json");
  expectNear(scene.camera.position, {4.001130f, 4.632640f, -4.310780f});  // the root's scale is 0.01
  EXPECT_NEAR(static_cast<double>(scene.camera.fov), 37.8492, 1e-4);
  // It looks at the duck: the line of sight passes its middle within half its height.
  const vec3 toMiddle(dvec3(0.134, 0.870, -0.037) - scene.camera.position), view = viewOf(scene.camera);
  EXPECT_LT(glm::length(glm::cross(toMiddle, view)), 0.77f);
  EXPECT_GT(glm::dot(toMiddle, view), 0);
  EXPECT_TRUE(scene.defaultLights);  // it brings none
  ASSERT_EQ(scene.solids.size(), 1u);
  const Mesh mesh = loadMesh(scene.solids[0], 1);
  EXPECT_EQ(mesh.triangles.size(), 4212u);
  EXPECT_NEAR(mesh.bounds().hi.y, 1.6397f, 1e-4f);
}

// --- what the scene says itself -----------------------------------------------------------------------------------

TEST(GltfImport, KeysOfTheScenesCameraOverrideTheImports) {
  const Shot shot(wholeShot());
  const Camera before = shot.scene().camera, camera = shot.scene("", R"(,"camera":{"fov":20,"target":[0,1,0]})").camera;
  EXPECT_EQ(camera.fov, 20);
  EXPECT_EQ(camera.target, dvec3(0, 1, 0));
  EXPECT_EQ(camera.position, before.position);
  EXPECT_EQ(camera.near, before.near);
  const Camera parallel = shot.scene("", R"(,"camera":{"type":"orthographic","height":3})").camera;
  EXPECT_EQ(parallel.projection, Projection::Orthographic);
  EXPECT_EQ(parallel.height, 3);
  EXPECT_EQ(parallel.position, before.position);
  EXPECT_TRUE(contains(shot.error("", R"(,"camera":{"far":0.125})"), "/camera/far: expected near < far"));
  EXPECT_TRUE(contains(shot.error("", R"(,"camera":{"target":[11,2,3]})"), "/camera/target: expected a target"));
}

TEST(GltfImport, ALightOfTheSameNameChangesTheImports) {
  const Shot shot(wholeShot());
  const Scene before = shot.scene();
  const Scene scene =
      shot.scene("", R"(,"lights":[{"name":"Sun","irradiance":9},{"name":"Key_Light","decay":1},{"name":"fill"}])");
  ASSERT_EQ(scene.lights.size(), 4u);
  LightSource key = before.lights[0], sun = before.lights[2];
  key.decay = 1, sun.strength = 9;
  EXPECT_EQ(scene.lights[0], key);
  EXPECT_EQ(scene.lights[1], before.lights[1]);
  EXPECT_EQ(scene.lights[2], sun);
  EXPECT_EQ(scene.lights[3].name, "fill");
  // Another type is another light.
  const LightSource spot = shot.scene("", R"(,"lights":[{"name":"Sun","type":"spot"}])").lights[2];
  EXPECT_EQ(spot, (LightSource{.name = "Sun", .type = LightType::Spot}));
  EXPECT_EQ(shot.scene("", R"(,"lights":[])").lights.size(), 3u);
  EXPECT_TRUE(contains(shot.error("", R"(,"lights":[{"name":"Sun"},{"name":"Sun"}])"), "/lights/0 has it"));
}

TEST(GltfImport, ALightWithoutANameIsNeverOneOfTheImport) {
  const Shot shot(gltf(kLights + R"("scenes":[{"nodes":[0]}],"nodes":[)" + lightNode("light0", 0) + "]"));
  EXPECT_TRUE(contains(shot.error("", R"(,"lights":[{"intensity":2}])"),
                       R"(/lights/0: expected a name that no other light has, got "light0" (a light of the import)"));
}

TEST(GltfImport, ASolidOfTheSameNameChangesTheImports) {
  const Shot shot(wholeShot());
  const Scene before = shot.scene();
  const Scene scene = shot.scene("", R"(,"solids":[{"name":"Box_001_2","mode":"holdout","translate":[0,0,5]},)"
                                     R"({"name":"Box_001","file":"box.obj"},{"file":"more.obj"}])");
  ASSERT_EQ(scene.solids.size(), 3u);
  Solid second = before.solids[1];
  second.mode = SolidMode::Holdout, second.translate = vec3(0, 0, 5), second.pointer = "/solids/0";
  EXPECT_EQ(scene.solids[1], second);
  EXPECT_EQ(scene.solids[0].file, shot.file("box.obj"));
  EXPECT_EQ(scene.solids[0].node, std::nullopt);
  EXPECT_EQ(scene.solids[2].name, "solid2");
  EXPECT_EQ(loadMesh(scene.solids[1], 1).bounds().lo, vec3(0, 9, 4));  // after the node's own place
  EXPECT_TRUE(contains(shot.error("", R"(,"solids":[{"name":"Bux","mode":"hidden"}])"),
                       R"(/solids/0/name: expected the name of a solid of the import, as there is no file, got "Bux" )"
                       R"((the nearest is "Box_001"))"));
  EXPECT_TRUE(contains(shot.error("", R"(,"solids":[{"name":"Box_001"},{"name":"Box_001"}])"), "/solids/0 has it"));
}

TEST(GltfImport, RefusesWrongKeysBeforeItOpensTheFile) {
  const auto message = [](const std::string& import) {
    try {
      parseScene(R"({"particles":[{"file":"x.prt"}],"import":)" + import + "}", "s.json");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(contains(message("3"), "/import: expected a glTF file, or an object with one, got 3"));
  EXPECT_TRUE(contains(message("{}"), R"(/import: expected "file", the glTF file, got none)"));
  EXPECT_TRUE(
      contains(message(R"({"file":"none.glb","camera":3})"), "/import/camera: expected true, false or the name"));
  EXPECT_TRUE(contains(message(R"({"file":"none.glb","light_units":"raw"})"), R"(expected "standard" or "unitless")"));
  EXPECT_TRUE(contains(message(R"({"file":"none.glb","light":true})"), R"(the nearest is "lights")"));
  EXPECT_TRUE(contains(message(R"("shot.####.glb")"), "/import: expected one file for all frames"));
}

// --- motion -------------------------------------------------------------------------------------------------------

TEST(GltfImport, MakesAKeyOfEachFrameOfAMovingCamera) {
  // As Blender bakes it: frames 1 to 5 at 24 frames a second, times in single precision.
  std::vector<float> times, values;
  for (int frame = 1; frame <= 5; ++frame) {
    times.push_back(static_cast<float>(frame) / 24);
    values.insert(values.end(), {static_cast<float>(frame * frame), 0, 8});
  }
  const Shot shot(moving("translation", "LINEAR", times, values));
  const Camera camera = shot.scene().camera;
  ASSERT_EQ(camera.keys.size(), 5u);
  for (int frame = 1; frame <= 5; ++frame) {
    const CameraKey& key = camera.keys[static_cast<std::size_t>(frame - 1)];
    EXPECT_EQ(key.frame, frame);
    EXPECT_EQ(*key.position, dvec3(frame * frame, 0, 8));
    expectNear(glm::normalize(*key.target - *key.position), {0, 0, -1});
    expectNear(*key.up, {0, 1, 0});
    EXPECT_FALSE(key.fov || key.height || key.focusDistance);
  }
  EXPECT_EQ(camera.position, dvec3(1, 0, 8));
  EXPECT_FALSE(camera.fitted);
  // Time 0 may be at another frame, and the scene may run faster: half frames between the file's are interpolated.
  EXPECT_EQ(shot.scene(R"(,"frame":100)").camera.keys.front().frame, 101);
  const std::vector<CameraKey> fast = shot.scene("", R"(,"frames":{"fps":48})").camera.keys;
  ASSERT_EQ(fast.size(), 9u);
  EXPECT_EQ(fast[0].frame, 2);
  expectNear(*fast[1].position, {2.5f, 0, 8});
}

TEST(GltfImport, TurnsTheShorterWayAlongAnArc) {
  const float c = std::cos(static_cast<float>(kPi) / 4);
  // 90 degrees about y, the second quaternion with the other sign.
  const Shot shot(moving("rotation", "LINEAR", {0, 3.0f / 24}, {0, 0, 0, 1, 0, -c, 0, -c}));
  const Camera camera = shot.scene().camera;
  ASSERT_EQ(camera.keys.size(), 4u);
  for (int frame = 0; frame <= 3; ++frame) {
    const double angle = frame * kPi / 6;
    expectNear(viewOf(cameraAt(camera, frame)), {-std::sin(angle), 0, -std::cos(angle)});
  }
}

TEST(GltfImport, HoldsStepsToTheFrameOfTheNextKey) {
  const Shot shot(moving("translation", "STEP", {1.0f / 24, 3.0f / 24}, {1, 0, 0, 7, 0, 0}));
  const std::vector<CameraKey> keys = shot.scene().camera.keys;
  ASSERT_EQ(keys.size(), 3u);
  EXPECT_EQ(keys[1].position->x, 1);
  EXPECT_EQ(keys[2].position->x, 7);  // although 3 / 24 s is not exactly 3.0f / 24
}

TEST(GltfImport, FollowsCubicSplines) {
  // x(t) = t³ over one second in a spline's terms: slopes 0 and 3.
  const Shot shot(moving("translation", "CUBICSPLINE", {0, 1}, {0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 1, 0, 0, 9, 9, 9}));
  const std::vector<CameraKey> keys = shot.scene("", R"(,"frames":{"fps":4})").camera.keys;
  ASSERT_EQ(keys.size(), 5u);
  for (int k = 0; k <= 4; ++k)
    EXPECT_NEAR(keys[static_cast<std::size_t>(k)].position->x, std::pow(k / 4.0f, 3.0f), 1e-6f) << k;
}

TEST(GltfImport, MovesACameraWithTheNodeThatItStandsUnder) {
  const Shot shot(moving("translation", "LINEAR", {0, 1.0f / 24}, {0, 0, 0, 4, 0, 0},
                         R"([{"children":[1],"scale":[2,2,2]},{"camera":0,"translation":[0,0,3]}])"));
  const std::vector<CameraKey> keys = shot.scene().camera.keys;
  ASSERT_EQ(keys.size(), 2u);
  EXPECT_EQ(*keys[0].position, dvec3(0, 0, 6));
  EXPECT_EQ(*keys[1].position, dvec3(4, 0, 6));
}

TEST(GltfImport, KeysOfTheSceneTakeThePlaceOfItsMotion) {
  const Shot shot(moving("translation", "LINEAR", {0, 2.0f / 24}, {0, 0, 8, 4, 0, 8}));
  const Camera fixed = shot.scene("", R"(,"camera":{"position":[0,5,1],"fov":30})").camera;
  ASSERT_EQ(fixed.keys.size(), 3u);  // it still looks where the motion looks
  for (const CameraKey& key : fixed.keys) EXPECT_TRUE(!key.position && key.target && key.up);
  EXPECT_EQ(cameraAt(fixed, 1).position, dvec3(0, 5, 1));
  EXPECT_EQ(fixed.fov, 30);
  EXPECT_TRUE(shot.scene("", R"(,"camera":{"position":[0,5,0],"target":[0,0,0],"up":[0,0,1]})").camera.keys.empty());
  const Camera keyed = shot.scene("", R"(,"camera":{"keys":[{"frame":7,"fov":20}]})").camera;
  ASSERT_EQ(keyed.keys.size(), 1u);
  EXPECT_EQ(keyed.position, dvec3(0, 0, 8));
  // A place from where the motion's target is straight up.
  EXPECT_TRUE(
      contains(shot.error("", R"(,"camera":{"position":[0,-5,0],"target":[0,5,0]})"), "expected an up direction"));
}

TEST(GltfImport, ReadsBuffersInTextAndBesideTheFile) {
  const std::string whole = moving("translation", "LINEAR", {0, 1.0f / 24}, {0, 0, 8, 4, 0, 8});
  const std::size_t json = whole.find('{'), binary = whole.find("BIN") + 4;
  const std::string text = whole.substr(json, binary - 8 - json), bytes = whole.substr(binary);
  const std::string length = fmt::format(R"("byteLength":{}}}],"bufferViews")", bytes.size());
  const auto withUri = [&](const std::string& uri) {
    std::string changed = text;
    return changed.replace(changed.find(length), length.size(),
                           fmt::format(R"("byteLength":{},"uri":"{}"}}],"bufferViews")", bytes.size(), uri));
  };
  const Shot inText(withUri("data:application/octet-stream;base64," + test::base64(bytes)), "shot.gltf");
  EXPECT_EQ(inText.scene().camera.keys.at(1).position, dvec3(4, 0, 8));
  EXPECT_EQ(inText.scene().imported.size(), 1u);
  const Shot beside(withUri("my%20shot.bin"), "shot.gltf");
  EXPECT_TRUE(contains(beside.error(), "shot.gltf: /buffers/0/uri: expected a file beside this one"));
  test::writeBytes(beside.file("my shot.bin"), bytes);
  EXPECT_EQ(beside.scene().camera.keys.at(1).position, dvec3(4, 0, 8));
  EXPECT_EQ(beside.scene().imported, (std::vector{beside.file("shot.gltf"), beside.file("my shot.bin")}));
  test::writeBytes(beside.file("my shot.bin"), bytes.substr(0, 170));
  EXPECT_TRUE(contains(beside.error(), "/buffers/0: expected 8 bytes from byte 168 on, got a buffer of 170"));
  EXPECT_TRUE(contains(Shot(withUri("https://a.b/c.bin"), "shot.gltf").error(), "expected a file beside this one"));
  EXPECT_TRUE(contains(Shot(withUri("data:;base64,AA*A"), "shot.gltf").error(), "expected data in base64"));
}

TEST(GltfImport, ReadsRotationsInNormalisedIntegers) {
  // 90 degrees about x in 16 bits: 23170 / 32767.
  const std::string bytes = bytesOf(std::vector<float>{0.5f}) + bytesOf(std::vector<std::int16_t>{23170, 0, 0, 23170});
  const Shot shot(glb(
      gltf(kLens + R"("buffers":[{"byteLength":12}],"bufferViews":[{"buffer":0,"byteLength":12}],"accessors":[)"
                   R"({"bufferView":0,"componentType":5126,"count":1,"type":"SCALAR"},{"bufferView":0,"byteOffset":4,)"
                   R"("componentType":5122,"normalized":true,"count":1,"type":"VEC4"}],"scenes":[{"nodes":[0]}],)"
                   R"("nodes":[{"camera":0}],"animations":[{"channels":[{"sampler":0,"target":{"node":0,)"
                   R"("path":"rotation"}}],"samplers":[{"input":0,"output":1}]}])"),
      bytes));
  ASSERT_EQ(shot.scene().camera.keys.size(), 1u);
  expectNear(viewOf(shot.scene().camera), {0, 1, 0});
}

// --- what is left out, with a warning -----------------------------------------------------------------------------

TEST(GltfImport, WarnsOfWhatItLeavesOut) {
  std::string json =
      gltf(boxMesh(168) +
           R"(,"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","range":5}]}},"skins":[{"joints":[0]}],)"
           R"("scenes":[{"nodes":[0,1,2,3]}],"nodes":[)" +
           lightNode("lamp", 0) +
           R"(,{"name":"gone","mesh":0,"scale":[0,0,1]},{"name":"wire","mesh":1},{"name":"man","mesh":0,"skin":0}],)"
           R"("animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],)"
           R"("samplers":[{"input":0,"output":0}]}])");
  const std::string mesh = R"("meshes":[)";
  json.replace(json.find(mesh), mesh.size(),
               R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]},)"
               R"({"primitives":[{"attributes":{"POSITION":0},"mode":1}]},)");
  std::vector<std::string> warnings;
  const Shot shot(glb(json, boxBytes()));
  {
    const WarningsKept kept(warnings);
    const Scene scene = shot.scene();
    ASSERT_EQ(scene.solids.size(), 1u);
    EXPECT_EQ(scene.solids[0].name, "man");
  }
  ASSERT_EQ(warnings.size(), 5u);
  EXPECT_TRUE(contains(warnings[0], "shot.glb: /nodes/0: the light lamp has a range"));
  EXPECT_TRUE(contains(warnings[1], "the light lamp stands still"));
  EXPECT_TRUE(contains(warnings[2], R"(/nodes/1: "gone" is left out: its scale leaves nothing)"));
  EXPECT_TRUE(contains(warnings[3], R"(/nodes/2: "wire" is left out: its mesh has no triangles)"));
  EXPECT_TRUE(contains(warnings[4], R"(/nodes/3: "man" stands as it was modelled)"));
}

}  // namespace
}  // namespace mote
