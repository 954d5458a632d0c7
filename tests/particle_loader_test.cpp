// Sources into one particle set: files and frames found, channels mapped, radii chosen, moved, merged, and refused with
// the particle's index.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/generate.h"
#include "host/particles/particle_loader.h"
#include "host/particles/spacing.h"
#include "tests/support/refusal.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::expectRefused;
using test::TempFolder;

ParticleSource fileSource(const std::string& path) {
  ParticleSource source;
  source.pointer = "/particles/0";
  source.file = path;
  return source;
}

/// What --strict asks for.
LoadRules strictly() {
  LoadRules rules;
  rules.strict = true;
  return rules;
}

/// Three particles with every channel.
struct Sample {
  std::vector<vec3> position{{1, 0, 0}, {0, 2, 0}, {0, 0, 3}}, color{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
      velocity{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  std::vector<float> radius{0.1f, 0.2f, 0.3f}, density{1, 2, 0};
  std::vector<std::uint64_t> id{7, 5, 3};

  void write(const std::string& path) const {
    const PrtColumn columns[] = {PrtColumn::of("Position", position), PrtColumn::of("Color", color),
                                 PrtColumn::of("Velocity", velocity), PrtColumn::of("Radius", radius),
                                 PrtColumn::of("Density", density),   PrtColumn::of("ID", id)};
    writePrt(path, columns);
  }
  void writePositions(const std::string& path) const {
    const PrtColumn column = PrtColumn::of("Position", position);
    writePrt(path, {&column, 1});
  }
};

TEST(ParticleLoader, TakesEveryChannelOfAFile) {
  const TempFolder folder;
  const Sample sample;
  sample.write(folder.file("a.prt"));
  std::vector<std::string> opened;
  const ParticleSet set = loadParticles({fileSource(folder.file("a.prt"))}, 1, DensityMode::CrossSection, &opened);
  EXPECT_EQ(set.position, sample.position);
  EXPECT_EQ(set.color, sample.color);
  EXPECT_EQ(set.velocity, sample.velocity);
  EXPECT_EQ(set.radius, sample.radius);  // auto takes the channel
  EXPECT_EQ(set.density, sample.density);
  EXPECT_EQ(set.id, sample.id);
  EXPECT_EQ(opened, std::vector<std::string>{folder.file("a.prt")});
}

TEST(ParticleLoader, FillsWhatAFileLacks) {
  const TempFolder folder;
  Sample().writePositions(folder.file("a.prt"));
  ParticleSource source = fileSource(folder.file("a.prt"));
  source.density = 3;
  source.color = vec3(0.5f, 0.25f, 1);
  source.radius = {RadiusRule::Kind::Number, 0.7f, "Radius", 1};
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.density, std::vector<float>(3, 3));
  EXPECT_EQ(set.radius, std::vector<float>(3, 0.7f));
  EXPECT_TRUE(set.color.empty());
  EXPECT_EQ(set.uniformColor, source.color);
  EXPECT_TRUE(set.velocity.empty());
  EXPECT_TRUE(set.id.empty());
}

TEST(ParticleLoader, FindsChannelsUnderTheNamesOfOtherPrograms) {
  const TempFolder folder;
  const Sample sample;
  const PrtColumn columns[] = {PrtColumn::of("Position", sample.position), PrtColumn::of("mass", sample.density),
                               PrtColumn::of("pscale", sample.radius)};
  writePrt(folder.file("a.prt"), columns);
  std::string bytes = test::readBytes(folder.file("a.prt"));
  bytes.replace(bytes.find("Position"), 8, std::string("P\0\0\0\0\0\0\0", 8));
  test::writeBytes(folder.file("a.prt"), bytes);
  const ParticleSet set = loadParticles({fileSource(folder.file("a.prt"))}, 1);
  EXPECT_EQ(set.position, sample.position);
  EXPECT_EQ(set.density, sample.density);
  EXPECT_EQ(set.radius, sample.radius);

  // Our own name comes first.
  const PrtColumn both[] = {PrtColumn::of("Position", sample.position), PrtColumn::of("mass", sample.radius),
                            PrtColumn::of("Density", sample.density)};
  writePrt(folder.file("b.prt"), both);
  EXPECT_EQ(loadParticles({fileSource(folder.file("b.prt"))}, 1).density, sample.density);
}

TEST(ParticleLoader, FindsTheNamesOfSimulationsAndOfMaya) {
  const TempFolder folder;
  const Sample sample;
  for (const char* radius : {"SmoothingLength", "SmoothingLengths", "Hsml", "radiusPP"})
    for (const char* velocity : {"Velocities", "velocities", "velocityPP"})
      for (const char* id : {"ParticleIDs", "particleId", "particle_id", "Ids"}) {
        const PrtColumn columns[] = {PrtColumn::of("Position", sample.position), PrtColumn::of(radius, sample.radius),
                                     PrtColumn::of("masses", sample.density),    PrtColumn::of("Cs", sample.color),
                                     PrtColumn::of(velocity, sample.velocity),   PrtColumn::of(id, sample.id)};
        writePrt(folder.file("a.prt"), columns);
        const ParticleSet set = loadParticles({fileSource(folder.file("a.prt"))}, 1);
        EXPECT_EQ(set.radius, sample.radius) << radius;
        EXPECT_EQ(set.density, sample.density);
        EXPECT_EQ(set.color, sample.color);
        EXPECT_EQ(set.velocity, sample.velocity) << velocity;
        EXPECT_EQ(set.id, sample.id) << id;
      }
}

TEST(ParticleLoader, MapsChannelsByTheNamesOfTheScene) {
  const TempFolder folder;
  const Sample sample;
  const PrtColumn columns[] = {PrtColumn::of("Position", sample.position), PrtColumn::of("rho", sample.density),
                               PrtColumn::of("pscale", sample.radius)};
  writePrt(folder.file("a.prt"), columns);
  // Our writer insists on a Position; other programs' files may call it otherwise.
  std::string bytes = test::readBytes(folder.file("a.prt"));
  bytes.replace(bytes.find("Position"), 8, std::string("Q\0\0\0\0\0\0\0", 8));
  test::writeBytes(folder.file("a.prt"), bytes);
  ParticleSource source = fileSource(folder.file("a.prt"));
  expectRefused([&] { loadParticles({source}, 1); },
                {"'Position'", "it has Q (3 × float32), rho (float32), pscale (float32)"});
  source.channels = {{"Position", "Q"}, {"Density", "rho"}, {"Radius", "pscale"}};
  ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.density, sample.density);
  EXPECT_EQ(set.radius, sample.radius);
  source.channels = {{"Position", "Q"}};
  source.radius = {RadiusRule::Kind::Channel, 0, "pscale", 2};
  set = loadParticles({source}, 1);
  EXPECT_EQ(set.radius, (std::vector<float>{0.2f, 0.4f, 0.6f}));

  source.radius.channel = "width";
  expectRefused([&] { loadParticles({source}, 1); }, {"/particles/0", "radius/channel", "'width'", "it has Q"});
  source.radius = {};
  source.channels["Density"] = "density";
  expectRefused([&] { loadParticles({source}, 1); }, {"/particles/0", "channels/Density", "'density'", "it has Q"});
  source.channels = {{"Densty", "rho"}};
  expectRefused([&] { loadParticles({source}, 1); }, {"'Densty'"});
}

TEST(ParticleLoader, ScalesRotatesAndTranslates) {
  const TempFolder folder;
  Sample().write(folder.file("a.prt"));
  ParticleSource source = fileSource(folder.file("a.prt"));
  source.scale = 2;
  source.rotate = vec3(90, 0, 90);  // x first takes y to z and z to −y; then z takes x to y and y to −x
  source.translate = vec3(10, 20, 30);
  const ParticleSet set = loadParticles({source}, 1);
  const vec3 expected[] = {{10, 22, 30}, {10, 20, 34}, {16, 20, 30}};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(glm::length(set.position[i] - expected[i]), 4e-6f) << i;  // 1 ulp at 32
  EXPECT_LT(glm::length(set.velocity[0] - vec3(0, 2, 0)), 1e-6f);
  EXPECT_LT(glm::length(set.velocity[1] - vec3(0, 0, 2)), 1e-6f);
  EXPECT_LT(glm::length(set.velocity[2] - vec3(2, 0, 0)), 1e-6f);
  EXPECT_EQ(set.radius, (std::vector<float>{0.2f, 0.4f, 0.6f}));
  EXPECT_EQ(set.density, (std::vector<float>{4, 8, 0}));
  EXPECT_EQ(loadParticles({source}, 1, DensityMode::Peak).density, (std::vector<float>{1, 2, 0}));
}

TEST(ParticleLoader, RotatesAboutYFromZTowardsX) {
  const TempFolder folder;
  Sample().write(folder.file("a.prt"));
  ParticleSource source = fileSource(folder.file("a.prt"));
  source.rotate = vec3(0, 90, 0);
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_LT(glm::length(set.position[2] - vec3(3, 0, 0)), 1e-6f);
}

TEST(ParticleLoader, MergesSourcesWithDifferentChannels) {
  const TempFolder folder;
  const Sample sample;
  sample.write(folder.file("a.prt"));
  sample.writePositions(folder.file("b.prt"));
  ParticleSource second = fileSource(folder.file("b.prt"));
  second.radius = {RadiusRule::Kind::Number, 0.5f, "Radius", 1};
  second.color = vec3(0.25f);
  const ParticleSet set = loadParticles({second, fileSource(folder.file("a.prt"))}, 1);
  ASSERT_EQ(set.size(), 6u);
  EXPECT_EQ(set.color[0], vec3(0.25f));
  EXPECT_EQ(set.color[4], vec3(0, 1, 0));
  EXPECT_EQ(set.velocity[2], vec3(0));
  EXPECT_EQ(set.velocity[3], vec3(1, 0, 0));
  EXPECT_EQ(set.id, (std::vector<std::uint64_t>{0, 1, 2, 7, 5, 3}));
  EXPECT_EQ(set.radius[0], 0.5f);
  EXPECT_EQ(set.radius[3], 0.1f);
  EXPECT_EQ(set.density[1], 1);
  EXPECT_EQ(set.density[4], 2);
}

// ---- absorption and emission ----

/// Sample with Absorption and Emission of their own.
struct Glowing : Sample {
  std::vector<vec3> absorption{{0, 0.5f, 3}, {1, 0, 0}, {0, 0, 0}}, emission{{10, 0, 0}, {0, 0.25f, 0}, {0, 0, 0}};

  void write(const std::string& path) const {
    const PrtColumn columns[] = {PrtColumn::of("Position", position), PrtColumn::of("Radius", radius),
                                 PrtColumn::of("Absorption", absorption), PrtColumn::of("Emission", emission)};
    writePrt(path, columns);
  }
};

TEST(ParticleLoader, TakesAbsorptionAndEmissionAndDoesNotScaleThem) {
  const TempFolder folder;
  const Glowing glowing;
  glowing.write(folder.file("a.prt"));
  ParticleSource source = fileSource(folder.file("a.prt"));
  source.scale = 2;
  source.rotate = vec3(90, 0, 0);
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.absorption, glowing.absorption);
  EXPECT_EQ(set.emission, glowing.emission);
}

TEST(ParticleLoader, TakesGreyAbsorptionAndEmissionByTheNamesOfTheScene) {
  const TempFolder folder;
  const Sample sample;
  const std::vector<float> soot{0.5f, 0, 2}, heat{1, 2, 3};
  const PrtColumn columns[] = {PrtColumn::of("Position", sample.position), PrtColumn::of("Radius", sample.radius),
                               PrtColumn::of("soot", soot), PrtColumn::of("heat", heat)};
  writePrt(folder.file("a.prt"), columns);
  ParticleSource source = fileSource(folder.file("a.prt"));
  EXPECT_TRUE(loadParticles({source}, 1).absorption.empty());
  EXPECT_TRUE(loadParticles({source}, 1).emission.empty());
  source.channels = {{"Absorption", "soot"}, {"Emission", "heat"}};
  const ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.absorption, (std::vector<vec3>{vec3(0.5f), vec3(0), vec3(2)}));
  EXPECT_EQ(set.emission, (std::vector<vec3>{vec3(1), vec3(2), vec3(3)}));
  source.channels = {{"Absorption", "ash"}};
  expectRefused([&] { loadParticles({source}, 1); }, {"channels/Absorption", "'ash'", "it has Position"});
}

TEST(ParticleLoader, GivesSourcesWithoutAbsorptionWhatTheirColourLeaves) {
  const TempFolder folder;
  Glowing().write(folder.file("glowing.prt"));
  Sample coloured;
  coloured.color = {{0.25f, 1, 0}, {2, 0, 0.5f}, {1, 1, 1}};  // brighter than 1: nothing is left
  coloured.write(folder.file("coloured.prt"));
  ParticleSource plain = fileSource(folder.file("plain.prt"));
  coloured.writePositions(plain.file);
  plain.radius = {RadiusRule::Kind::Number, 1, "Radius", 1};
  plain.color = vec3(0.75f, 1, 0);
  const ParticleSet set =
      loadParticles({fileSource(folder.file("coloured.prt")), plain, fileSource(folder.file("glowing.prt"))}, 1);
  ASSERT_EQ(set.absorption.size(), 9u);
  EXPECT_EQ(set.absorption[0], vec3(0.75f, 0, 1));
  EXPECT_EQ(set.absorption[1], vec3(0, 1, 0.5f));
  EXPECT_EQ(set.absorption[2], vec3(0));
  EXPECT_EQ(set.absorption[3], vec3(0.25f, 0, 1));
  EXPECT_EQ(set.absorption[6], vec3(0, 0.5f, 3));
  ASSERT_EQ(set.emission.size(), 9u);
  EXPECT_EQ(set.emission[5], vec3(0));
  EXPECT_EQ(set.emission[6], vec3(10, 0, 0));
}

TEST(ParticleLoader, RefusesBadAbsorptionAndEmission) {
  const TempFolder folder;
  const std::string path = folder.file("a.prt");
  Glowing glowing;
  glowing.absorption[1].z = -0.5f;
  glowing.write(path);
  expectRefused([&] { loadParticles({fileSource(path)}, 1, strictly()); },
                {"a.prt: particle 1: absorption", "finite numbers ≥ 0", "(1, 0, -0.5)"});
  glowing.absorption[1].z = std::numeric_limits<float>::quiet_NaN();
  glowing.write(path);
  expectRefused([&] { loadParticles({fileSource(path)}, 1, strictly()); }, {"particle 1: absorption", "nan"});
  glowing = {};
  glowing.emission[2].x = std::numeric_limits<float>::infinity();
  glowing.write(path);
  expectRefused([&] { loadParticles({fileSource(path)}, 1, strictly()); }, {"particle 2: emission", "inf"});
}

TEST(ParticleLoader, KeepsTwoUniformColoursApart) {
  const TempFolder folder;
  Sample().writePositions(folder.file("a.prt"));
  ParticleSource one = fileSource(folder.file("a.prt")), two = one;
  two.color = vec3(0.5f);
  EXPECT_TRUE(loadParticles({one, one}, 1).color.empty());
  const ParticleSet set = loadParticles({one, two}, 1);
  ASSERT_EQ(set.color.size(), 6u);
  EXPECT_EQ(set.color[0], vec3(1));
  EXPECT_EQ(set.color[5], vec3(0.5f));
}

TEST(ParticleLoader, GeneratesSources) {
  ParticleSource source;
  source.generate = Generator::Ball;
  source.count = 1000;
  source.seed = 3;
  const ParticleSet ball = generateParticles(Generator::Ball, 1000, 3, 1);
  ParticleSet set = loadParticles({source}, 1);
  EXPECT_EQ(set.position, ball.position);
  EXPECT_EQ(set.radius, ball.radius);  // auto is the generator's own
  source.radius = {RadiusRule::Kind::Channel, 0, "Radius", 2};
  EXPECT_EQ(loadParticles({source}, 1).radius[0], 2 * ball.radius[0]);
  source.radius.channel = "width";
  expectRefused([&] { loadParticles({source}, 1); }, {"'width'"});
}

TEST(ParticleLoader, FindsFramesAndSaysWhichExist) {
  const TempFolder folder;
  const Sample sample;
  for (const char* name : {"p.0001.prt", "p.0002.prt", "p.0007.prt"}) sample.write(folder.file(name));
  const ParticleSource source = fileSource(folder.file("p.####.prt"));
  std::vector<std::string> opened;
  EXPECT_EQ(loadParticles({source}, 7, DensityMode::CrossSection, &opened).size(), 3u);
  EXPECT_EQ(opened, std::vector<std::string>{folder.file("p.0007.prt")});
  expectRefused([&] { loadParticles({source}, 3); }, {"p.0003.prt", "no such file", "3 frames from 1 to 7"});
  expectRefused([&] { loadParticles({fileSource(folder.file("q.0001.prt"))}, 1); },
                {"q.0001.prt", "nearest names", "'p.0001.prt'"});
  expectRefused([&] { loadParticles({fileSource(folder.file("no/q.prt"))}, 1); }, {"/no' does not exist"});
}

TEST(ParticleLoader, RefusesBadParticlesByIndex) {
  const TempFolder folder;
  const std::string path = folder.file("a.prt");
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const auto refused = [&](const std::function<void(Sample&)>& spoil, const std::vector<std::string>& words) {
    Sample sample;
    spoil(sample);
    sample.write(path);
    expectRefused([&] { loadParticles({fileSource(path)}, 1, strictly()); }, words);
  };
  refused([&](Sample& s) { s.position[1].y = nan; }, {"a.prt: particle 1: position", "nan"});
  refused([&](Sample& s) { s.position[2].x = inf, s.position[0].z = -inf; }, {"particle 0: position", "-inf"});
  refused([&](Sample& s) { s.radius[2] = 0; }, {"particle 2: radius", "got 0"});
  refused([&](Sample& s) { s.radius[0] = -1; }, {"particle 0: radius", "-1"});
  refused([&](Sample& s) { s.radius[1] = nan; }, {"particle 1: radius", "nan"});
  refused([&](Sample& s) { s.density[1] = -0.5f; }, {"particle 1: density", "-0.5"});
  refused([&](Sample& s) { s.density[1] = inf; }, {"particle 1: density", "inf"});
  refused([&](Sample& s) { s.color[1].x = nan; }, {"particle 1: colour"});
}

TEST(ParticleLoader, RefusesDoublePositionsBeyondFloat) {
  const TempFolder folder;
  std::vector<double> doubles{1, 2, 3, 4, 1e300, 6};
  std::vector<vec3> dummy(2);
  const PrtColumn columns[] = {PrtColumn::raw("P64", NumberType::F64, 3, std::as_bytes(std::span(doubles))),
                               PrtColumn::of("Position", dummy)};
  writePrt(folder.file("a.prt"), columns);
  ParticleSource source = fileSource(folder.file("a.prt"));
  source.channels["Position"] = "P64";
  expectRefused([&] { loadParticles({source}, 1, strictly()); }, {"particle 1: position", "inf"});
}

TEST(ParticleLoader, RefusesWhatScalingMakesInfinite) {
  const TempFolder folder;
  Sample sample;
  sample.position[1].x = 1e30f;
  sample.write(folder.file("a.prt"));
  ParticleSource source = fileSource(folder.file("a.prt"));
  source.scale = 1e10f;
  expectRefused([&] { loadParticles({source}, 1, strictly()); }, {"particle 1: position in the scene"});
}

TEST(ParticleLoader, RefusesNoParticlesAtAll) {
  const TempFolder folder;
  const std::vector<vec3> none;
  const PrtColumn column = PrtColumn::of("Position", none);
  writePrt(folder.file("none.prt"), {&column, 1});
  Sample().write(folder.file("a.prt"));
  const ParticleSource empty = fileSource(folder.file("none.prt"));
  expectRefused([&] { loadParticles({empty}, 1); }, {"none.prt", "at least one particle"});
  takeWarnings();
  EXPECT_EQ(loadParticles({empty, fileSource(folder.file("a.prt"))}, 1).size(), 3u);
  EXPECT_EQ(takeWarnings().size(), 1u);
}

TEST(ParticleLoader, AsksForARadiusWhereSpacingGivesNone) {
  const TempFolder folder;
  for (const std::size_t count : {1u, 20u}) {
    const std::vector<vec3> positions(count, vec3(1, 2, 3));
    const PrtColumn column = PrtColumn::of("Position", positions);
    writePrt(folder.file("a.prt"), {&column, 1});
    ParticleSource source = fileSource(folder.file("a.prt"));
    expectRefused([&] { loadParticles({source}, 1); }, {"a.prt", "give /particles/0 a \"radius\""});
    source.radius = {RadiusRule::Kind::Number, 1, "Radius", 1};
    EXPECT_EQ(loadParticles({source}, 1).size(), count);
  }
}

// ---- spacing ----

/// All distances, sorted: what meanNeighbourDistance must equal.
double bruteForceSpacing(const std::vector<vec3>& positions) {
  double sum = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    std::vector<double> distances;
    for (std::size_t j = 0; j < positions.size(); ++j)
      if (j != i) distances.push_back(glm::length(dvec3(positions[j]) - dvec3(positions[i])));
    const std::size_t k = std::min<std::size_t>(8, distances.size());
    std::partial_sort(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(k), distances.end());
    double own = 0;
    for (std::size_t n = 0; n < k; ++n) own += distances[n];
    sum += own / static_cast<double>(k);
  }
  return sum / static_cast<double>(positions.size());
}

std::vector<vec3> jitteredGrid(int side) {
  std::vector<vec3> positions;
  Random random(11);
  for (int i = 0; i < side * side * side; ++i)
    positions.push_back(
        vec3(i % side + random.uniform(), i / side % side + random.uniform(), i / (side * side) + random.uniform()));
  return positions;
}

// Same neighbours, distances in double, summed in another order: 1e-12 is a thousand roundings.
constexpr double kSameSum = 1e-12;

TEST(Spacing, AgreesWithBruteForceOnAJitteredGrid) {
  const std::vector<vec3> positions = jitteredGrid(13);  // 2197: every particle is asked, several buckets
  const double expected = bruteForceSpacing(positions);
  EXPECT_NEAR(meanNeighbourDistance(positions) / expected, 1, kSameSum);
}

TEST(Spacing, AgreesWithBruteForceOnClustersOutliersAndDuplicates) {
  Random random(5);
  std::vector<vec3> positions;
  for (int i = 0; i < 1500; ++i)
    positions.push_back(vec3(1000, 2, 3) + vec3(1e-2 * random.uniform() * random.direction()));
  for (int i = 0; i < 700; ++i) positions.push_back(vec3(random.direction()));
  for (int i = 0; i < 800; ++i) positions.push_back(vec3(0.5f));
  for (int i = 0; i < 300; ++i) positions.push_back(vec3(i, 0, 0));  // a line: one axis only
  positions.push_back(vec3(1e7f, 0, 0));
  const double expected = bruteForceSpacing(positions);
  EXPECT_NEAR(meanNeighbourDistance(positions) / expected, 1, kSameSum);
}

TEST(Spacing, TakesTheNeighboursThereAreAndNoneForCoincidingParticles) {
  EXPECT_DOUBLE_EQ(meanNeighbourDistance(std::vector<vec3>{{0, 0, 0}, {3, 4, 0}}), 5);
  EXPECT_EQ(meanNeighbourDistance(std::vector<vec3>{{1, 2, 3}}), 0);
  EXPECT_EQ(meanNeighbourDistance(std::vector<vec3>{}), 0);
  EXPECT_EQ(meanNeighbourDistance(std::vector<vec3>(100'000, vec3(7))), 0);
}

TEST(Spacing, SampleIsCloseToAllAndTheSameForAnyNumberOfThreads) {
  const std::vector<vec3> positions = jitteredGrid(40);  // 64,000
  const double all = meanNeighbourDistance(positions, positions.size());
  double sampled[2];
  for (const unsigned threads : {1u, 2u}) {
    const ThreadLimit limit(threads);
    sampled[threads - 1] = meanNeighbourDistance(positions);
  }
  EXPECT_EQ(sampled[0], sampled[1]);
  // The mean distance varies by about 15 % from particle to particle: 4 standard errors of 4096 of them are 1 %.
  EXPECT_NEAR(sampled[0] / all, 1, 0.01);
}

TEST(Spacing, PoissonFormulaFitsUniformParticles) {
  const ParticleSet ball = generateParticles(Generator::Ball, 200'000, 1, 1);
  const double formula = poissonNeighbourDistance(200'000 / (4.0 / 3 * kPi));
  // Sampling 0.3 % (18 % spread over 4096); at the surface neighbours lie on one side only: within one spacing (0.026,
  // 8 % of the particles) the distances grow by up to a quarter, together at most 2 %.
  EXPECT_NEAR(meanNeighbourDistance(ball.position) / formula, 1.01, 0.015);
}

}  // namespace
}  // namespace mote
