// Between frames: the cubic through two of them, particles that are found by their ID, and those that are not.
#include "host/particles/sub_frames.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "host/core/log.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/support/refusal.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::expectRefused;
using test::TempFolder;

dvec3 onCircle(double angle) { return {std::cos(angle), std::sin(angle), 0}; }
dvec3 circleVelocity(double angle, double speed) { return speed * dvec3(-std::sin(angle), std::cos(angle), 0); }

/// The greatest error over one step of `length` seconds on a circle that is run through at 1 rad/s.
double worstOf(double length, bool hermite) {
  double worst = 0;
  for (int i = 0; i <= 64; ++i) {
    const double time = length * i / 64;
    const dvec3 at = hermite ? hermiteAt(onCircle(0), circleVelocity(0, 1), onCircle(length), circleVelocity(length, 1),
                                         length, time)
                             : onCircle(0) + time * circleVelocity(0, 1);
    worst = std::max(worst, glm::distance(at, onCircle(time)));
  }
  return worst;
}

TEST(SubFrames, TheCubicIsOfFourthOrderAndTheLineOfSecond) {
  for (const double length : {0.8, 0.4, 0.2, 0.1}) {
    // Halving the step divides the error by 16 and 4, but for terms of the next order: 1 % of it at 0.4.
    EXPECT_NEAR(worstOf(length, true) / worstOf(length / 2, true), 16, 0.7) << length;
    EXPECT_NEAR(worstOf(length, false) / worstOf(length / 2, false), 4, 0.2) << length;
    EXPECT_LT(worstOf(length, true), std::pow(length, 4) / 384 * 1.001) << length;  // the bound of the header
  }
  EXPECT_GT(worstOf(0.2, false) / worstOf(0.2, true), 4000);
}

TEST(SubFrames, TheCubicPassesThroughBothEnds) {
  const dvec3 a(1, 2, 3), b(4, -1, 0), v(0.5, 7, 1), w(2, 2, -3);
  EXPECT_EQ(hermiteAt(a, v, b, w, 0.25, 0), a);
  EXPECT_EQ(hermiteAt(a, v, b, w, 0.25, 0.25), b);
  const double h = 1e-6;  // one-sided: off by h · |x″| / 2, some 1e-3 here
  EXPECT_LT(glm::distance((hermiteAt(a, v, b, w, 0.25, h) - a) / h, v), 2e-3);
  EXPECT_LT(glm::distance((b - hermiteAt(a, v, b, w, 0.25, 0.25 - h)) / h, w), 2e-3);
}

// ---- files ----

constexpr double kFps = 10, kTurn = 3;  // rad/s: 0.3 rad a frame

struct Particles {
  std::vector<vec3> position, velocity;
  std::vector<std::uint64_t> id;

  void add(std::uint64_t name, const dvec3& at, const dvec3& moves) {
    position.push_back(vec3(at)), velocity.push_back(vec3(moves)), id.push_back(name);
  }
  void write(const std::string& path, bool withId = true, bool withVelocity = true) const {
    std::vector<PrtColumn> columns{PrtColumn::of("Position", position)};
    if (withVelocity) columns.push_back(PrtColumn::of("Velocity", velocity));
    if (withId) columns.push_back(PrtColumn::of("ID", id));
    writePrt(path, columns);
  }
};

constexpr std::size_t kCount = 40;
double phase(std::uint64_t id) { return 0.1 * static_cast<double>(id); }
double angleAt(std::uint64_t id, double frame) { return phase(id) + kTurn * frame / kFps; }

/// Frames 4, 5, 6 of particles on a circle, in another order in each.
void writeCircle(const TempFolder& folder) {
  for (const int frame : {4, 5, 6}) {
    Particles particles;
    for (std::size_t i = 0; i < kCount; ++i) {
      const std::uint64_t id = (i * 7 + static_cast<std::size_t>(frame)) % kCount;
      particles.add(id, onCircle(angleAt(id, frame)), circleVelocity(angleAt(id, frame), kTurn));
    }
    particles.write(folder.file("c.000" + std::to_string(frame) + ".prt"));
  }
}

ParticleSource sourceOf(const std::string& path) {
  ParticleSource source;
  source.pointer = "/particles/0";
  source.file = path;
  source.radius = {RadiusRule::Kind::Number, 0.1f, "Radius", 1};
  source.interpolate = Interpolation::Hermite;
  return source;
}

LoadRules rulesOf(float opens, float closes) {
  LoadRules rules;
  rules.framesPerSecond = kFps;
  rules.shutter = vec2(opens, closes);
  return rules;
}

/// Where particle i is drawn when `time` has passed since the frame's.
dvec3 drawnAt(const ParticleSet& set, std::size_t i, double time) {
  if (set.shutterVelocity.empty()) return dvec3(set.position[i]) + time * dvec3(set.velocity[i]);
  return dvec3(set.position[i]) + dvec3(set.shutterShift[i]) + time * dvec3(set.shutterVelocity[i]);
}

double worstOnCircle(const ParticleSet& set, int frame, std::initializer_list<double> times) {
  double worst = 0;
  for (std::size_t i = 0; i < set.size(); ++i)
    for (const double time : times)
      worst = std::max(worst, glm::distance(drawnAt(set, i, time), onCircle(angleAt(set.id[i], frame + time * kFps))));
  return worst;
}

TEST(SubFrames, ParticlesFollowTheirCurveToBothEndsOfTheShutter) {
  const TempFolder folder;
  writeCircle(folder);
  ParticleSource source = sourceOf(folder.file("c.####.prt"));
  const LoadRules rules = rulesOf(-0.05f, 0.05f);  // half a frame each way: 0.15 rad
  std::vector<std::string> opened;
  const ParticleSet curved = loadParticles({source}, 5, rules, &opened);
  source.interpolate = Interpolation::Velocity;
  const ParticleSet straight = loadParticles({source}, 5, rules);
  EXPECT_TRUE(straight.shutterVelocity.empty());
  EXPECT_EQ(curved.position, straight.position);
  EXPECT_EQ(curved.velocity, straight.velocity);
  // 0.3⁴/384 = 2.1e-5 against 0.15²/2 = 0.011.
  EXPECT_LT(worstOnCircle(curved, 5, {-0.05, 0.05}), 2.2e-5);
  EXPECT_GT(worstOnCircle(straight, 5, {-0.05, 0.05}), 0.011);
  EXPECT_EQ(opened, (std::vector<std::string>{folder.file("c.0005.prt"), folder.file("c.0004.prt"),
                                              folder.file("c.0006.prt")}));
}

TEST(SubFrames, AShutterThatOpensAtTheFrameLeavesThePlaceAndReadsOneFileMore) {
  const TempFolder folder;
  writeCircle(folder);
  std::vector<std::string> opened;
  const ParticleSet set = loadParticles({sourceOf(folder.file("c.####.prt"))}, 5, rulesOf(0, 0.08f), &opened);
  for (const vec3& shift : set.shutterShift) EXPECT_EQ(shift, vec3(0));
  EXPECT_LT(worstOnCircle(set, 5, {0, 0.08}), 2.2e-5);
  EXPECT_EQ(opened.size(), 2u);
  EXPECT_TRUE(loadParticles({sourceOf(folder.file("c.####.prt"))}, 5, rulesOf(0.02f, 0.02f)).shutterVelocity.empty());
}

TEST(SubFrames, BeyondTheFramesBesideParticlesGoOnAlongTheirVelocityThere) {
  const TempFolder folder;
  writeCircle(folder);
  const ParticleSet set = loadParticles({sourceOf(folder.file("c.####.prt"))}, 5, rulesOf(-0.15f, 0.15f));
  for (std::size_t i = 0; i < set.size(); ++i) {
    const double after = angleAt(set.id[i], 6), before = angleAt(set.id[i], 4);
    EXPECT_LT(glm::distance(drawnAt(set, i, 0.15), onCircle(after) + 0.05 * circleVelocity(after, kTurn)), 1e-6);
    EXPECT_LT(glm::distance(drawnAt(set, i, -0.15), onCircle(before) - 0.05 * circleVelocity(before, kTurn)), 1e-6);
  }
}

TEST(SubFrames, MovesWithItsSource) {
  const TempFolder folder;
  writeCircle(folder);
  ParticleSource source = sourceOf(folder.file("c.####.prt"));
  const LoadRules rules = rulesOf(-0.05f, 0.03f);
  const ParticleSet plain = loadParticles({source}, 5, rules);
  source.scale = 2;
  source.rotate = vec3(0, 0, 90);  // x to y, y to −x
  source.translate = dvec3(100, 0, 0);
  const ParticleSet moved = loadParticles({source}, 5, rules);
  for (std::size_t i = 0; i < plain.size(); ++i)
    for (const double time : {-0.05, 0.03}) {
      const dvec3 p = drawnAt(plain, i, time);
      EXPECT_LT(glm::distance(drawnAt(moved, i, time), dvec3(100 - 2 * p.y, 2 * p.x, 2 * p.z)), 1e-5);  // float at 100
    }
}

TEST(SubFrames, BornAndGoneAndNamesakesGoAlongTheirVelocity) {
  const TempFolder folder;
  const dvec3 v(1, 2, 3);
  Particles before, now, after;
  before.add(1, dvec3(0), dvec3(0)), before.add(3, dvec3(0), dvec3(0)), before.add(3, dvec3(0), dvec3(0));
  now.add(1, dvec3(1, 0, 0), v);  // gone after
  now.add(2, dvec3(2, 0, 0), v);  // born now
  now.add(3, dvec3(3, 0, 0), v);  // two of that name before
  now.add(4, dvec3(4, 0, 0), v), now.add(4, dvec3(5, 0, 0), v);
  after.add(2, dvec3(9, 0, 0), dvec3(0)), after.add(4, dvec3(9, 9, 0), dvec3(0)), after.add(6, dvec3(1), v);
  before.write(folder.file("b.1.prt")), now.write(folder.file("b.2.prt")), after.write(folder.file("b.3.prt"));
  const ParticleSet set = loadParticles({sourceOf(folder.file("b.#.prt"))}, 2, rulesOf(-0.05f, 0.05f));
  ASSERT_EQ(set.size(), 5u);
  const auto straight = [&](std::size_t i, double time) {
    return glm::distance(drawnAt(set, i, time), dvec3(set.position[i]) + time * v) < 1e-6;
  };
  EXPECT_FALSE(straight(0, -0.05));
  EXPECT_TRUE(straight(0, 0.05));
  EXPECT_TRUE(straight(1, -0.05));
  EXPECT_FALSE(straight(1, 0.05));
  for (const std::size_t i : {2u, 3u, 4u}) EXPECT_TRUE(straight(i, -0.05) && straight(i, 0.05)) << i;
}

TEST(SubFrames, TheEndsOfASequenceGoAlongTheirVelocity) {
  const TempFolder folder;
  writeCircle(folder);
  const ParticleSet last = loadParticles({sourceOf(folder.file("c.####.prt"))}, 6, rulesOf(-0.05f, 0.05f));
  EXPECT_LT(worstOnCircle(last, 6, {-0.05}), 2.2e-5);
  for (std::size_t i = 0; i < last.size(); ++i)
    EXPECT_LT(glm::distance(drawnAt(last, i, 0.05), dvec3(last.position[i]) + 0.05 * dvec3(last.velocity[i])), 1e-6);
}

TEST(SubFrames, SourcesWithoutCurvesKeepTheirVelocityBesideOthers) {
  const TempFolder folder;
  writeCircle(folder);
  ParticleSource other = sourceOf(folder.file("c.####.prt"));
  other.interpolate = Interpolation::Velocity;
  const ParticleSet set = loadParticles({other, sourceOf(folder.file("c.####.prt"))}, 5, rulesOf(-0.05f, 0.05f));
  ASSERT_EQ(set.shutterVelocity.size(), 2 * kCount);
  EXPECT_EQ(set.shutterVelocity[3], set.velocity[3]);
  EXPECT_EQ(set.shutterShift[3], vec3(0));
  EXPECT_NE(set.shutterVelocity[kCount + 3], set.velocity[kCount + 3]);
}

TEST(SubFrames, RefusesFilesWithoutFramesVelocitiesOrIds) {
  const TempFolder folder;
  writeCircle(folder);
  const LoadRules rules = rulesOf(-0.05f, 0.05f);
  expectRefused([&] { loadParticles({sourceOf(folder.file("c.0005.prt"))}, 5, rules); },
                {"/particles/0: interpolate", "c.0005.prt", "as in plume.####.prt"});
  Particles two;
  two.add(0, dvec3(0), dvec3(1)), two.add(1, dvec3(1), dvec3(1));
  two.write(folder.file("d.1.prt"), false), two.write(folder.file("d.2.prt"), true, false);
  expectRefused([&] { loadParticles({sourceOf(folder.file("d.#.prt"))}, 1, rules); },
                {"/particles/0: interpolate", "the channel ID", "d.1.prt, which has none"});
  expectRefused([&] { loadParticles({sourceOf(folder.file("d.#.prt"))}, 2, rules); }, {"Velocity", "d.2.prt"});
  two.write(folder.file("d.3.prt"));
  expectRefused([&] { loadParticles({sourceOf(folder.file("d.#.prt"))}, 3, rules); }, {"Velocity", "d.2.prt"});
}

}  // namespace
}  // namespace mote
