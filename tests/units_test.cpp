// What a file's numbers stand for: axes, units of length, and what velocities are per.
#include <gtest/gtest.h>

#include <cmath>

#include "host/core/error.h"
#include "host/particles/file_units.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/particle_loader.h"
#include "tests/support/refusal.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::expectRefused;
using test::TempFolder;

const std::vector<vec3> kPosition{{1, 2, 3}, {-4, 5, 0.1f}}, kVelocity{{0.5f, 0, -2}, {1, 1, 3}};
const std::vector<float> kRadius{0.1f, 0.2f}, kDensity{3, 4};

/// A file of two particles, and a source of it.
ParticleSource sourceOf(const std::string& path, const std::vector<Metadata>& metadata = {}) {
  const PrtColumn columns[] = {PrtColumn::of("Position", kPosition), PrtColumn::of("Velocity", kVelocity),
                               PrtColumn::of("Radius", kRadius), PrtColumn::of("Density", kDensity)};
  writePrt(path, columns, metadata);
  ParticleSource source;
  source.pointer = "/particles/0";
  source.file = path;
  return source;
}

TEST(FileUnits, NothingIsConvertedUnlessTheSceneSaysSo) {
  const TempFolder folder;
  const ParticleSource source = sourceOf(
      folder.file("a.prt"), {Metadata::int32("", "CoordSys", 2), Metadata::float64("", "LengthUnitInMeters", 0.01)});
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.position, kPosition);
  EXPECT_EQ(set.velocity, kVelocity);
  EXPECT_EQ(set.radius, kRadius);
  EXPECT_EQ(set.density, kDensity);
}

TEST(FileUnits, TurnsZUpIntoYUpExactly) {
  const TempFolder folder;
  ParticleSource source = sourceOf(folder.file("a.prt"));
  source.up = UpAxis::Z;
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.position, (std::vector<vec3>{{1, 3, -2}, {-4, 0.1f, -5}}));
  EXPECT_EQ(set.velocity, (std::vector<vec3>{{0.5f, -2, 0}, {1, 3, -1}}));
  EXPECT_EQ(set.radius, kRadius);
}

TEST(FileUnits, TakesAxesFromTheFileAndMirrorsLeftHandedOnes) {
  const TempFolder folder;
  const vec3 expected[] = {{1, 2, 3}, {1, 3, -2}, {1, 2, -3}, {1, 3, 2}};
  for (int coordSys = 1; coordSys <= 4; ++coordSys) {
    ParticleSource source = sourceOf(folder.file("a.prt"), {Metadata::int32("", "CoordSys", coordSys)});
    source.up = UpAxis::File;
    EXPECT_EQ(loadParticles({source}, 1).position[0], expected[coordSys - 1]) << coordSys;
    source.up = UpAxis::Y;  // the scene knows better
    EXPECT_EQ(loadParticles({source}, 1).position[0], kPosition[0]) << coordSys;
  }
  for (const std::vector<Metadata>& silent :
       {std::vector<Metadata>{}, {Metadata::int32("", "CoordSys", 0)}, {Metadata::int32("", "CoordSys", 5)}}) {
    ParticleSource source = sourceOf(folder.file("a.prt"), silent);
    source.up = UpAxis::File;
    expectRefused([&] { loadParticles({source}, 1); }, {"/particles/0: up", "CoordSys", "a.prt", R"(say "y" or "z")"});
  }
}

TEST(FileUnits, ScalesLengthsRadiiVelocitiesAndAreas) {
  const TempFolder folder;
  ParticleSource source = sourceOf(folder.file("a.prt"), {Metadata::float64("", "LengthUnitInMeters", 0.5)});
  source.unit = LengthUnit{.fromFile = true};
  source.translate = vec3(10, 0, 0);  // in the scene's unit, the metre
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.position[0], vec3(10.5f, 1, 1.5f));
  EXPECT_EQ(set.velocity[0], vec3(0.25f, 0, -1));
  EXPECT_EQ(set.radius, (std::vector<float>{0.05f, 0.1f}));
  EXPECT_EQ(set.density, (std::vector<float>{0.75f, 1}));
  EXPECT_EQ(loadParticles({source}, 1, DensityMode::Peak).density, kDensity);

  source.radius = {RadiusRule::Kind::Number, 4, "Radius", 1};  // in the file's unit, as its positions
  EXPECT_EQ(loadParticles({source}, 1).radius, (std::vector<float>{2, 2}));
  source.unit = LengthUnit{.metres = 0.25};
  EXPECT_EQ(loadParticles({source}, 1).position[0], vec3(10.25f, 0.5f, 0.75f));
}

TEST(FileUnits, RefusesAUnitThatTheFileDoesNotSay) {
  const TempFolder folder;
  ParticleSource source = sourceOf(folder.file("a.prt"));
  source.unit = LengthUnit{.fromFile = true};
  expectRefused([&] { loadParticles({source}, 1); },
                {"/particles/0: unit", "LengthUnitInMeters", "a.prt, which does not", "give the metres as a number"});
  for (const double wrong : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    source = sourceOf(folder.file("a.prt"), {Metadata::float64("", "LengthUnitInMeters", wrong)});
    source.unit = LengthUnit{.fromFile = true};
    expectRefused([&] { loadParticles({source}, 1); }, {"a.prt: metadata LengthUnitInMeters", "a finite number > 0"});
  }
}

TEST(FileUnits, ReadsVelocitiesPerFrame) {
  const TempFolder folder;
  ParticleSource source = sourceOf(folder.file("a.prt"));
  source.velocityPer = VelocityTime::Frame;
  Scene scene;
  scene.frames.fps = 25;
  EXPECT_EQ(loadParticles({source}, 1, LoadRules(scene)).velocity[0], vec3(12.5f, 0, -50));
  source.unit = LengthUnit{.metres = 2};
  EXPECT_EQ(loadParticles({source}, 1, LoadRules(scene)).velocity[0], vec3(25, 0, -100));
  source.velocityPer = VelocityTime::Second;
  EXPECT_EQ(loadParticles({source}, 1, LoadRules(scene)).velocity[0], vec3(1, 0, -4));
}

TEST(FileUnits, ReadsWhatTheMakersFilesSay) {
  const auto fractal = openParticleFile(test::sharedFile("prt/prt_fractal_for_krscene.prt"));
  const FileMeaning meaning = meaningOf(*fractal);
  ASSERT_TRUE(meaning.axes);
  EXPECT_EQ(axesText(*meaning.axes), "right-handed, y up");
  ASSERT_TRUE(meaning.metres);
  EXPECT_GT(*meaning.metres, 0);
}

}  // namespace
}  // namespace mote
