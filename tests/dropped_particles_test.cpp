// Particles that are not finite or of no size: left out and counted, or refused.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/particle_loader.h"
#include "tests/support/refusal.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::expectRefused;
using test::TempFolder;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

/// Ten particles in a row, each with numbers of its own.
struct Row {
  std::vector<vec3> position, color, velocity;
  std::vector<float> radius, density;
  std::vector<std::uint64_t> id;

  explicit Row(std::size_t count = 10) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto x = static_cast<float>(i);
      position.push_back(vec3(x, 0, 0)), color.push_back(vec3(x / 100)), velocity.push_back(vec3(0, x, 0));
      radius.push_back(1 + x), density.push_back(x), id.push_back(100 + i);
    }
  }
  ParticleSource write(const std::string& path, bool withId) const {
    std::vector<PrtColumn> columns{PrtColumn::of("Position", position), PrtColumn::of("Color", color),
                                   PrtColumn::of("Velocity", velocity), PrtColumn::of("Radius", radius),
                                   PrtColumn::of("Density", density)};
    if (withId) columns.push_back(PrtColumn::of("ID", id));
    writePrt(path, columns);
    ParticleSource source;
    source.pointer = "/particles/0";
    source.file = path;
    return source;
  }
};

std::vector<float> xOf(const ParticleSet& set) {
  std::vector<float> x;
  for (const vec3& p : set.position) x.push_back(p.x);
  return x;
}

Row damagedRow() {
  Row row;
  row.position[2].y = kNan, row.position[7].z = -kInf;
  row.radius[0] = 0, row.radius[2] = -1;  // particle 2 counts once, for its position
  row.density[5] = -0.5f;
  return row;
}

TEST(DroppedParticles, AreLeftOutOfEveryArrayWithOneWarningThatCountsThem) {
  const TempFolder folder;
  const ParticleSource source = damagedRow().write(folder.file("a.prt"), true);
  takeWarnings();
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(xOf(set), (std::vector<float>{1, 3, 4, 6, 8, 9}));
  EXPECT_EQ(set.radius, (std::vector<float>{2, 4, 5, 7, 9, 10}));
  EXPECT_EQ(set.density, (std::vector<float>{1, 3, 4, 6, 8, 9}));
  EXPECT_EQ(set.velocity[1], vec3(0, 3, 0));
  EXPECT_EQ(set.color[5], vec3(0.09f));
  EXPECT_EQ(set.id, (std::vector<std::uint64_t>{101, 103, 104, 106, 108, 109}));
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 1u);
  for (const char* words : {"a.prt: 4 of 10 particles left out: ",
                            "2 whose position is not numbers that are finite in float32 (particle 2: ", "nan",
                            "1 whose radius is not a finite number > 0 (particle 0: 0)",
                            "1 whose density is not a finite number ≥ 0 (particle 5: -0.5)", "--strict"})
    EXPECT_NE(warnings[0].find(words), std::string::npos) << words << "\n" << warnings[0];
}

TEST(DroppedParticles, AreRefusedWhereTheSceneIsStrict) {
  const TempFolder folder;
  const ParticleSource source = damagedRow().write(folder.file("a.prt"), true);
  LoadRules rules;
  rules.strict = true;
  expectRefused([&] { loadParticles({source}, 1, rules); },
                {"a.prt: particle 2: position: expected numbers that are finite in float32, got (2, nan, 0)"});
}

TEST(DroppedParticles, LeaveTheirIndexToTheOthersAsId) {
  const TempFolder folder;
  const ParticleSource damaged = damagedRow().write(folder.file("a.prt"), false),
                       whole = Row(3).write(folder.file("b.prt"), false);
  EXPECT_TRUE(loadParticles({whole, whole}, 1).id.empty());
  EXPECT_EQ(loadParticles({damaged, whole}, 1).id, (std::vector<std::uint64_t>{1, 3, 4, 6, 8, 9, 10, 11, 12}));
}

TEST(DroppedParticles, KeepTheirFilesNumbersThroughASecondCheck) {
  const TempFolder folder;
  Row row = damagedRow();
  row.position[4].x = 1e30f;  // finite in the file, not in the scene
  ParticleSource source = row.write(folder.file("a.prt"), false);
  source.scale = 1e10f;
  takeWarnings();
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.id, (std::vector<std::uint64_t>{1, 3, 6, 8, 9}));
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[1].find("1 of 10 particles left out: 1 whose position in the scene is not"), std::string::npos);
  EXPECT_NE(warnings[1].find("(particle 4: "), std::string::npos) << warnings[1];
}

TEST(DroppedParticles, AreAnErrorWhereNoneIsLeft) {
  const TempFolder folder;
  Row row;
  for (float& r : row.radius) r = 0;
  row.radius[0] = -2;
  const ParticleSource source = row.write(folder.file("a.prt"), false);
  takeWarnings();
  expectRefused([&] { loadParticles({source}, 1); },
                {"a.prt: particle 0: radius", "got -2", "of its 10 particles none is fit to be drawn"});
  EXPECT_TRUE(takeWarnings().empty());
}

TEST(DroppedParticles, AreTheSameForAnyNumberOfThreads) {
  const TempFolder folder;
  Row row(200'000);  // several blocks
  for (std::size_t i = 0; i < row.radius.size(); i += 7) row.radius[i] = kNan;
  const ParticleSource source = row.write(folder.file("a.prt"), false);
  std::vector<ParticleSet> sets;
  std::vector<std::string> warnings;
  for (const unsigned threads : {1u, 2u}) {
    const ThreadLimit limit(threads);
    takeWarnings();
    sets.push_back(loadParticles({source}, 1));
    warnings.push_back(takeWarnings().at(0));
  }
  EXPECT_EQ(sets[0].id, sets[1].id);
  EXPECT_EQ(sets[0].position, sets[1].position);
  EXPECT_EQ(warnings[0], warnings[1]);
  EXPECT_EQ(sets[0].size(), 200'000u - (200'000u + 6) / 7);
}

}  // namespace
}  // namespace mote
