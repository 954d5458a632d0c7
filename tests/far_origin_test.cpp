// Particles far from the origin: read in double, measured from a point among them, and in register with all else.
#include <gtest/gtest.h>

#include <cmath>

#include "host/core/log.h"
#include "host/core/random.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/particle_loader.h"
#include "host/scene/origin.h"
#include "host/scene/scene_reader.h"
#include "tests/support/refusal.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::TempFolder;

/// UTM coordinates of a survey [m], a millimetre apart.
const dvec3 kSurvey(512'345.678, 4'123'456.789, 212.3);

std::vector<dvec3> cloudAt(const dvec3& centre, std::size_t count = 500, double radius = 0.05) {
  Random random(3);
  std::vector<dvec3> positions;
  for (std::size_t i = 0; i < count; ++i)
    positions.push_back(centre + radius * random.uniform() * dvec3(random.direction()));
  return positions;
}

/// A file of Position64 in double; PRT's Position, which its makers want in float32, is zero.
ParticleSource write(const std::string& path, const std::vector<dvec3>& positions) {
  const std::vector<vec3> zero(positions.size(), vec3(0));
  const PrtColumn columns[] = {PrtColumn::raw("Position64", NumberType::F64, 3, std::as_bytes(std::span(positions))),
                               PrtColumn::of("Position", zero)};
  writePrt(path, columns);
  ParticleSource source;
  source.pointer = "/particles/0";
  source.file = path;
  source.channels = {{"Position", "Position64"}};
  source.radius = {RadiusRule::Kind::Number, 0.002f, "Radius", 1};
  return source;
}

double worstError(const ParticleSet& set, std::size_t from, const std::vector<dvec3>& expected) {
  double worst = 0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    worst = std::max(worst, glm::distance(dvec3(set.position[from + i]) + set.origin, expected[i]));
  return worst;
}

// Half a float32's step below twice the cloud's extent, on three axes, twice: about the file's centre and in the scene.
constexpr double kRounding = 2 * 0.1 * 0x1p-24 * 1.8;

TEST(FarOrigin, KeepsMillimetresOfASurveyAndSaysWhereFrom) {
  const TempFolder folder;
  const std::vector<dvec3> positions = cloudAt(kSurvey);
  const ParticleSource source = write(folder.file("a.prt"), positions);
  takeWarnings();
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_LT(worstError(set, 0, positions), kRounding);
  EXPECT_GT(set.origin.y, 4.1e6);
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("4.12346e+06"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("steps of 0.25"), std::string::npos) << warnings[0];

  LoadRules here;
  here.origin = dvec3(0);  // what happens without: float32 goes in steps of 0.25 there
  EXPECT_GT(worstError(loadParticles({source}, 1, here), 0, positions), 0.03);
  EXPECT_TRUE(takeWarnings().empty());
  here.origin = dvec3(512'000, 4'123'000, 0);  // as the frame before, or the scene, had it
  const ParticleSet there = loadParticles({source}, 1, here);
  EXPECT_EQ(there.origin, *here.origin);
  EXPECT_LT(worstError(there, 0, positions), 1e-4);  // half a step at 457, on three axes: 2.6e-5
}

TEST(FarOrigin, TranslatesInDouble) {
  const TempFolder folder;
  const std::vector<dvec3> positions = cloudAt(kSurvey);
  ParticleSource source = write(folder.file("a.prt"), positions);
  source.translate = -kSurvey;
  takeWarnings();
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.origin, dvec3(0));
  EXPECT_TRUE(takeWarnings().empty());
  std::vector<dvec3> moved;
  for (const dvec3& p : positions) moved.push_back(p - kSurvey);
  EXPECT_LT(worstError(set, 0, moved), kRounding);
}

TEST(FarOrigin, ScalesTurnsAndConvertsInDouble) {
  const TempFolder folder;
  const std::vector<dvec3> positions = cloudAt(kSurvey);
  ParticleSource source = write(folder.file("a.prt"), positions);
  source.up = UpAxis::Z;
  source.unit = LengthUnit{.metres = 0.5};
  source.rotate = vec3(0, 90, 0);  // z to x, x to −z
  const ParticleSet set = loadParticles({source}, 1);
  std::vector<dvec3> expected;
  for (const dvec3& p : positions) expected.push_back(0.5 * dvec3(-p.y, p.z, -p.x));
  // The angle's cosine is 6e-17 off 0: of 4 million that is nothing.
  EXPECT_LT(worstError(set, 0, expected), kRounding);
}

TEST(FarOrigin, KeepsSourcesInRegister) {
  const TempFolder folder;
  const std::vector<dvec3> one = cloudAt(kSurvey), two = cloudAt(kSurvey + dvec3(0.001, 0, 0.07), 200);
  const ParticleSet set = loadParticles({write(folder.file("a.prt"), one), write(folder.file("b.prt"), two)}, 1);
  EXPECT_LT(worstError(set, 0, one), kRounding);
  EXPECT_LT(worstError(set, one.size(), two), kRounding);
}

TEST(FarOrigin, LeavesWhatIsNearAsItIs) {
  const TempFolder folder;
  std::vector<vec3> floats;
  std::vector<dvec3> doubles;
  for (const dvec3& p : cloudAt(dvec3(3, 2, 1), 500, 1)) floats.push_back(vec3(p)), doubles.push_back(dvec3(vec3(p)));
  const ParticleSet set = loadParticles({write(folder.file("a.prt"), doubles)}, 1);
  EXPECT_EQ(set.origin, dvec3(0));
  EXPECT_EQ(set.position, floats);
}

TEST(FarOrigin, GivesTheSameBitsForFloatsAndTheirDoubles) {
  const TempFolder folder;
  std::vector<vec3> floats;
  std::vector<dvec3> doubles;
  for (const dvec3& p : cloudAt(dvec3(3000, 0.5, -200), 500, 1)) {
    floats.push_back(vec3(p));
    doubles.push_back(dvec3(vec3(p)));
  }
  const PrtColumn column = PrtColumn::of("Position", floats);
  writePrt(folder.file("f.prt"), {&column, 1});
  ParticleSource wide = write(folder.file("d.prt"), doubles), narrow = wide;
  narrow.file = folder.file("f.prt");
  narrow.channels.clear();
  wide.radius = narrow.radius = {};
  const ParticleSet a = loadParticles({narrow}, 1), b = loadParticles({wide}, 1);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_NEAR(a.radius[0], b.radius[0], 1e-6f * a.radius[0]);  // summed in another order
}

TEST(FarOrigin, TakesTheSpacingFromWhatTheFileHas) {
  const TempFolder folder;
  ParticleSource here = write(folder.file("a.prt"), cloudAt(dvec3(0))),
                 there = write(folder.file("b.prt"), cloudAt(kSurvey));
  here.radius = there.radius = {};
  const float expected = loadParticles({here}, 1).radius[0];
  // Doubles at 4 million go in steps of 5e-10, spacing is 0.008.
  EXPECT_NEAR(loadParticles({there}, 1).radius[0] / expected, 1, 1e-6);
}

TEST(FarOrigin, ReadsTheMakersFileNear1e15) {
  const std::string path = test::sharedFile("prt/doubleFloat.prt");
  const auto file = openParticleFile(path);
  std::vector<dvec3> positions;
  const ChannelRequest request{"Position", &positions};
  file->read({&request, 1});
  ParticleSource source;
  source.file = path;
  source.radius = {RadiusRule::Kind::Number, 1, "Radius", 1};
  const ParticleSet set = loadParticles({source}, 1);
  ASSERT_EQ(set.size(), positions.size());
  dvec3 lo = positions[0], hi = lo;
  for (const dvec3& p : positions) lo = glm::min(lo, p), hi = glm::max(hi, p);
  const double extent = glm::length(hi - lo);
  EXPECT_LT(worstError(set, 0, positions), std::max(extent, 1.0) * 0x1p-23) << extent;
}

// ---- the rule ----

TEST(FarOrigin, IsRoundedToAPowerOfTwoOfTheExtentAxisByAxis) {
  EXPECT_EQ(originOf(dvec3(-1), dvec3(1)), dvec3(0));
  EXPECT_EQ(originOf(dvec3(5), dvec3(7)), dvec3(0));                           // within eight half lengths
  EXPECT_EQ(originOf(dvec3(6), dvec3(7.9)), dvec3(7));                         // not so
  EXPECT_EQ(originOf({1000, 3, -70.5}, {1003, 4, -69}), dvec3(1002, 0, -70));  // half 1.5, steps of 2
  EXPECT_EQ(originOf(dvec3(5e5, 0, 0), dvec3(5e5, 0, 0)), dvec3(5e5, 0, 0));   // a point
  EXPECT_EQ(originOf(dvec3(0), dvec3(0)), dvec3(0));
  EXPECT_EQ(originOf(dvec3(100), dvec3(101), 30), dvec3(0));  // with radii of 30 it is not far
}

TEST(FarOrigin, TakesCameraKeysAndLightsAlongOnce) {
  Scene scene;
  scene.camera.position = kSurvey + dvec3(0, 1, 4);
  scene.camera.target = kSurvey;
  scene.camera.keys = {{.frame = 1, .position = kSurvey}, {.frame = 2, .fov = 30.0f}};
  scene.lights.resize(1);
  scene.lights[0].position = kSurvey - dvec3(1, 2, 3);
  const dvec3 origin(512'345, 4'123'456, 0);
  for (int times = 0; times < 2; ++times) {
    moveOrigin(scene, origin);
    EXPECT_EQ(scene.origin, origin);
    EXPECT_LT(glm::distance(scene.camera.position, dvec3(0.678, 1.789, 216.3)), 1e-9);
    EXPECT_LT(glm::distance(*scene.camera.keys[0].position, dvec3(0.678, 0.789, 212.3)), 1e-9);
    EXPECT_FALSE(scene.camera.keys[1].position);
    EXPECT_LT(glm::distance(scene.lights[0].position, dvec3(-0.322, -1.211, 209.3)), 1e-9);
  }
  moveOrigin(scene, dvec3(0));
  EXPECT_LT(glm::distance(scene.camera.target, kSurvey), 1e-9);
}

TEST(FarOrigin, IsReadFromTheScene) {
  const auto originIn = [](const std::string& key) {
    return parseScene(R"({"particles":[{"file":"x.prt","translate":[512345.678,0,0]}])" + key + "}", "s.json");
  };
  EXPECT_EQ(originIn("").origin, std::nullopt);
  EXPECT_EQ(originIn("").particles[0].translate.x, 512345.678);  // more than a float32 has
  EXPECT_EQ(originIn(R"(,"origin":"auto")").origin, std::nullopt);
  EXPECT_EQ(originIn(R"(,"origin":[512345.678,0,1])").origin, dvec3(512345.678, 0, 1));
  EXPECT_EQ(LoadRules(originIn(R"(,"origin":[0,0,0])")).origin, dvec3(0));
  test::expectRefused([&] { originIn(R"(,"origin":true)"); }, {"/origin", R"([x, y, z] or "auto")", "true"});
  test::expectRefused([&] { originIn(R"(,"origin":[1,2])"); }, {"/origin", "an array of 3 numbers"});
}

}  // namespace
}  // namespace mote
