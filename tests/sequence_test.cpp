// Sequences: which frames have files, what a gap is, and what is held in it.
#include "host/scene/sequence.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "host/core/log.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/particle_loader.h"
#include "tests/support/refusal.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using test::expectRefused;
using test::TempFolder;

void touch(const TempFolder& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) test::writeBytes(folder.file(name), "x");
}

Scene sceneOf(const std::string& pattern, int first, int last, int step = 1) {
  Scene scene;
  scene.particles.resize(1);
  scene.particles[0].file = pattern;
  scene.frames.first = first, scene.frames.last = last, scene.frames.step = step;
  return scene;
}

TEST(Sequence, FindsTheFramesThatExistAsThePatternWritesThem) {
  const TempFolder folder;
  touch(folder, {"p.0001.prt", "p.0010.prt", "p.-003.prt", "p.12345.prt", "p.2.prt", "p.00003.prt", "p.0004.prt.bak",
                 "q.0005.prt", "p..prt", "p.prt"});
  EXPECT_EQ(existingFrames(folder.file("p.####.prt")), (std::vector<int>{-3, 1, 10, 12345}));
  EXPECT_EQ(existingFrames(folder.file("p.%04d.prt")), (std::vector<int>{-3, 1, 10, 12345}));
  EXPECT_EQ(existingFrames(folder.file("p.#.prt")), (std::vector<int>{2, 12345}));
  EXPECT_EQ(existingFrames(folder.file("p.%d.prt")), (std::vector<int>{2, 12345}));
  EXPECT_TRUE(existingFrames(folder.file("p.0001.prt")).empty());
  EXPECT_TRUE(existingFrames(folder.file("no/p.####.prt")).empty());
}

TEST(Sequence, GapsAreErrorsThatNameTheMissingFramesInRanges) {
  const TempFolder folder;
  touch(folder, {"p.0001.prt", "p.0002.prt", "p.0006.prt", "p.0007.prt", "p.0008.prt", "p.0010.prt"});
  const std::string pattern = folder.file("p.####.prt");
  expectRefused([&] { checkSequences(sceneOf(pattern, 1, 10)); },
                {"p.####.prt: expected a file for every frame of 1-10, got none for frames 3-5, 9",
                 "6 frames from 1 to 10 exist", "--missing hold"});
  expectRefused([&] { checkSequences(sceneOf(pattern, 1, 9, 2)); }, {"1-9x2", "none for frames 3-5x2, 9"});
  expectRefused([&] { checkSequences(sceneOf(pattern, 9, 9)); }, {"a file for frame 9", "none for frame 9"});
  EXPECT_NO_THROW(checkSequences(sceneOf(pattern, 6, 8)));
  EXPECT_NO_THROW(checkSequences(sceneOf(pattern, 2, 10, 4)));
  EXPECT_NO_THROW(checkSequences(sceneOf(folder.file("p.0001.prt"), 1, 10)));  // one file for all frames
  expectRefused([&] { checkSequences(sceneOf(folder.file("q.####.prt"), 1, 2)); },
                {"none for frames 1-2", "nearest names"});
}

TEST(Sequence, SaysHowManyRangesThereAreWhereTheyAreMany) {
  const TempFolder folder;
  for (int frame = 1; frame <= 99; frame += 2) touch(folder, {"p." + std::to_string(frame) + ".prt"});
  expectRefused([&] { checkSequences(sceneOf(folder.file("p.#.prt"), 1, 99)); },
                {"none for frames 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24 and 37 ranges more"});
}

TEST(Sequence, LooksForTheFilesOfSolidsToo) {
  const TempFolder folder;
  touch(folder, {"m.1.obj"});
  Scene scene = sceneOf(folder.file("p.prt"), 1, 2);
  scene.solids.resize(1);
  scene.solids[0].file = folder.file("m.#.obj");
  expectRefused([&] { checkSequences(scene); }, {"m.#.obj", "none for frame 2"});
}

TEST(Sequence, HoldsTheNearestEarlierFrame) {
  const TempFolder folder;
  touch(folder, {"p.0002.prt", "p.0005.prt"});
  const std::string pattern = folder.file("p.####.prt");
  takeWarnings();
  EXPECT_EQ(fileFrame(pattern, 5, MissingFrames::Hold), 5);
  EXPECT_EQ(fileFrame(pattern, 4, MissingFrames::Error), 4);
  EXPECT_TRUE(takeWarnings().empty());
  EXPECT_EQ(fileFrame(pattern, 4, MissingFrames::Hold), 2);
  EXPECT_EQ(fileFrame(pattern, 900, MissingFrames::Hold), 5);
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("p.0004.prt: no such file; frame 2 is held"), std::string::npos) << warnings[0];
  EXPECT_EQ(fileFrame(pattern, 1, MissingFrames::Hold), 1);  // there is none to hold

  Scene scene = sceneOf(pattern, 2, 9);
  scene.inputs.missing = MissingFrames::Hold;
  EXPECT_NO_THROW(checkSequences(scene));
  scene.frames.first = -1;
  expectRefused([&] { checkSequences(scene); }, {"or an earlier one", "none for frames -1-1", "2 frames from 2 to 5"});
}

TEST(Sequence, LoadsTheParticlesOfTheFrameThatIsHeld) {
  const TempFolder folder;
  const std::vector<vec3> position{{1, 2, 3}};
  const std::vector<float> radius{1};
  const PrtColumn columns[] = {PrtColumn::of("Position", position), PrtColumn::of("Radius", radius)};
  writePrt(folder.file("p.007.prt"), columns);
  ParticleSource source;
  source.file = folder.file("p.%03d.prt");
  LoadRules rules;
  expectRefused([&] { loadParticles({source}, 9, rules); }, {"p.009.prt", "only frame 7 exists"});
  rules.missing = MissingFrames::Hold;
  std::vector<std::string> opened;
  EXPECT_EQ(loadParticles({source}, 9, rules, &opened).position, position);
  EXPECT_EQ(opened, std::vector<std::string>{folder.file("p.007.prt")});
}

}  // namespace
}  // namespace mote
