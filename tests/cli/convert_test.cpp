// mote convert and mote info over all formats, as a user meets them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/mote_program.h"
#include "tests/support/shared_data.h"
#include "tests/support/written_file.h"

namespace mote::test {
namespace {

using nlohmann::json;

std::vector<RawChannel> ball(std::size_t count = 50) {
  return {anyNumbers("Position", NumberType::F32, 3, count), anyNumbers("Radius", NumberType::F32, 1, count),
          anyNumbers("ID", NumberType::U32, 1, count)};
}

TEST(MoteConvert, WritesEveryFormatAndBack) {
  const TempFolder folder;
  writeRaw(OutputFormat::Prt1, folder.file("a.prt"), ball());
  for (const std::string& name : std::vector<std::string>{"b.ply", "b.csv", "b.npy", "b.prt"}) {
    const ProcessResult result = mote({"convert", folder.file("a.prt"), folder.file(name)});
    ASSERT_EQ(result.exitCode, 0) << result.err;
    EXPECT_TRUE(contains(result.out, name + ": "));
    EXPECT_TRUE(contains(result.out, "50 particles"));
    expectChannels(*openParticleFile(folder.file(name)), ball());
  }
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--format", "prt2", "--compression", "lz4"}, {"--format", "ply", "--ascii"}}) {
    std::vector<std::string> arguments{"convert", folder.file("a.prt"), folder.file("c")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ASSERT_EQ(mote(arguments).exitCode, 0);
    expectChannels(*openParticleFile(folder.file("c")), ball());
  }
}

TEST(MoteConvert, ReportsWhatWasLostForPeopleAndPrograms) {
  const TempFolder folder;
  writeRaw(OutputFormat::Prt1, folder.file("a.prt"),
           {anyNumbers("Position", NumberType::F32, 3, 2),
            rawChannel<std::int64_t>("ID", NumberType::I64, 1, {9007199254740993, 1})},
           {}, {Metadata::int32("", "CoordSys", 2)});
  const ProcessResult people = mote({"convert", folder.file("a.prt"), folder.file("b.ply")});
  EXPECT_EQ(people.exitCode, 0);
  EXPECT_TRUE(contains(people.out, "from int64; 1 of 2 numbers changed"));
  EXPECT_TRUE(contains(people.out, "left out, as PLY cannot hold them: metadata CoordSys"));
  const ProcessResult programs = mote({"convert", "--json", folder.file("a.prt"), folder.file("b.ply")});
  const json report = json::parse(programs.out);
  EXPECT_EQ(report["format"], "PLY");
  EXPECT_EQ(report["written"], 2);
  EXPECT_EQ(report["channels"][1]["changed"], 1);
  EXPECT_EQ(report["channels"][1]["from_type"], "int64");
  EXPECT_EQ(report["lost_metadata"], json{"CoordSys"});
}

TEST(MoteConvert, ConvertsSequencesAndNamesMissingFrames) {
  const TempFolder folder;
  for (const int frame : {1, 2, 4})
    writeRaw(OutputFormat::Prt1, folder.file("a.000" + std::to_string(frame) + ".prt"), ball());
  const ProcessResult done = mote({"convert", "--frames", "1-2", folder.file("a.####.prt"), folder.file("b.####.npy")});
  ASSERT_EQ(done.exitCode, 0) << done.err;
  expectChannels(*openParticleFile(folder.file("b.0002.npy")), ball());
  const ProcessResult missing =
      mote({"convert", "--frames", "1-6", folder.file("a.####.prt"), folder.file("c.####.npy")});
  EXPECT_EQ(missing.exitCode, 2);
  for (const char* name : {"3 files that do not exist", "a.0003.prt", "a.0005.prt", "a.0006.prt"})
    EXPECT_TRUE(contains(missing.err, name));
  EXPECT_EQ(folder.entries().size(), 5u) << "nothing is written before all frames are known to be there";
  EXPECT_TRUE(contains(mote({"convert", folder.file("a.####.prt"), folder.file("c.####.npy")}).err, "--frames A-B"));
  EXPECT_TRUE(contains(mote({"convert", "--frames", "1-2", folder.file("a.####.prt"), folder.file("c.npy")}).err,
                       "a name with ####"));
}

TEST(MoteConvert, ChoosesMovesAndThinsOut) {
  const TempFolder folder;
  writeRaw(OutputFormat::Npy, folder.file("a.npy"),
           {rawChannel<float>("Position", NumberType::F32, 3, {1, 2, 3}),
            rawChannel<float>("rho", NumberType::F32, 1, {0.5})});
  const ProcessResult result =
      mote({"convert", folder.file("a.npy"), folder.file("b.npy"), "--channels", "Density=rho,Position", "--scale", "2",
            "--rotate", "0,0,90", "--translate", "-1,0,10", "--type", "Density=float16"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto file = openParticleFile(folder.file("b.npy"));
  EXPECT_EQ(describeChannels(file->channels()), "Density (float16), Position (3 × float32)");
  const vec3 p = readNumbers<vec3>(*file, "Position")[0];
  EXPECT_LT(glm::length(p - vec3(-5, 2, 16)), 1e-5f) << "(1, 2, 3) doubled, turned and put there";
  writeRaw(OutputFormat::Prt1, folder.file("c.prt"), ball(1000));
  EXPECT_EQ(
      mote({"convert", "--channels", "Position", "--rotate", "0,0,90", folder.file("c.prt"), folder.file("d.npy")})
          .exitCode,
      0)
      << "lists end at a blank";
  const ProcessResult thin = mote({"convert", folder.file("c.prt"), folder.file("d.prt"), "--subsample", "0.25"});
  EXPECT_TRUE(contains(thin.out, "particles of 1000"));
  const ProcessResult again = mote({"convert", folder.file("c.prt"), folder.file("e.prt"), "--subsample", "0.25"});
  EXPECT_EQ(readBytes(folder.file("d.prt")), readBytes(folder.file("e.prt")));
  const ProcessResult other =
      mote({"convert", folder.file("c.prt"), folder.file("e.prt"), "--subsample", "0.25", "--seed", "1"});
  EXPECT_NE(readBytes(folder.file("d.prt")), readBytes(folder.file("e.prt")));
}

TEST(MoteConvert, NeverOverwritesAnInput) {
  const TempFolder folder;
  writeRaw(OutputFormat::Prt1, folder.file("a.prt"), ball());
  writeRaw(OutputFormat::Prt1, folder.file("b.prt"), ball());
  const std::string before = readBytes(folder.file("a.prt"));
  std::filesystem::create_symlink(folder.file("a.prt"), folder.file("link.prt"));
  for (const std::string& output : {folder.file("a.prt"), folder.path() + "/./a.prt", folder.file("link.prt")}) {
    const ProcessResult result = mote({"convert", folder.file("b.prt"), folder.file("a.prt"), output});
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_TRUE(contains(result.err, "never overwritten"));
  }
  EXPECT_EQ(readBytes(folder.file("a.prt")), before);
}

TEST(MoteConvert, LeavesNoHalfFileAndWhatStoodThereWhereItFails) {
  const TempFolder folder;
  writeRaw(OutputFormat::Prt1, folder.file("a.prt"), ball(100'000));
  writeBytes(folder.file("b.npy"), "what stood there");
  const ProcessResult full = mote({"convert", folder.file("a.prt"), folder.file("b.npy")}, {.largestFile = 100'000});
  EXPECT_EQ(full.exitCode, 3);
  EXPECT_TRUE(contains(full.err, "writing failed"));
  EXPECT_EQ(readBytes(folder.file("b.npy")), "what stood there");
  writeBytes(folder.file("a.prt"), readBytes(folder.file("a.prt")).substr(0, 100'000));
  const ProcessResult cut = mote({"convert", folder.file("a.prt"), folder.file("b.npy")});
  EXPECT_EQ(cut.exitCode, 2);
  EXPECT_TRUE(contains(cut.err, "mote repair"));
  EXPECT_EQ(readBytes(folder.file("b.npy")), "what stood there");
  EXPECT_EQ(folder.entries().size(), 2u);
}

TEST(MoteConvert, SaysWhatIsWrongWithItsArguments) {
  const TempFolder folder;
  const std::string in = folder.file("a.prt"), out = folder.file("b.npy");
  writeRaw(OutputFormat::Prt1, in, ball());
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{in}, "one input or more, then the output"},
      {{in, folder.file("b.bgeo")}, "ends in .prt, .ply, .csv, .npy"},
      {{folder.file("A.prt"), out}, "no such file"},
      {{in, out, "--scale", "0"}, "> 0"},
      {{in, out, "--subsample", "1.5"}, "--subsample"},
      {{in, out, "--rotate", "1,2"}, "--rotate"},
      {{in, out, "--type", "ID=half"}, "NAME=TYPE"},
      {{in, out, "--type", "id=int8"}, "a channel that is written: Position, Radius, ID"},
      {{in, out, "--channels", "Position,Position"}, "again"},
      {{in, out, "--channels", "rho"}, "it has Position"},
      {{in, out, "--format", "vdb"}, "one of prt, prt2, ply, csv, npy"},
      {{in, out, "--compression", "lz4"}, "PRT 2"},
      {{in, folder.file("no/b.npy")}, "does not exist"}};
  for (const auto& [arguments, message] : cases) {
    std::vector<std::string> all{"convert"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const ProcessResult result = mote(all);
    EXPECT_EQ(result.exitCode, 2) << message;
    EXPECT_TRUE(contains(result.err, message));
    EXPECT_EQ(folder.entries().size(), 1u) << message;
  }
}

TEST(MoteInfo, DescribesEveryFormatAndSaysWhichChannelIsWhich) {
  const std::pair<const char*, const char*> files[] = {{"bgeo/particle_grid.bgeo", "BGEO 5"},
                                                       {"sph/bunny_frame_14_7705_particles.vtk", "VTK"},
                                                       {"ply/train-1000.ply", "PLY"},
                                                       {"npy/halo_low_res.npy", "NPY"},
                                                       {"csv/float16.csv", "CSV"},
                                                       {"prt/wnormals.prt", "PRT 2"},
                                                       {"prt/prt_fractal_for_krscene.prt", "PRT 1.1"}};
  std::vector<std::string> all{"info", "--json"};
  for (const auto& [name, format] : files) {
    const ProcessResult one = mote({"info", sharedFile(name)});
    EXPECT_EQ(one.exitCode, 0) << one.err;
    EXPECT_TRUE(contains(one.out, format));
    all.push_back(sharedFile(name));
  }
  const ProcessResult result = mote(all);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 7);
  const json grid = json::parse(result.out.substr(0, result.out.find('\n')));
  EXPECT_EQ(grid["channels"][0]["ours"], "Position");
}

TEST(MoteInfo, FindsTheRadiusUnderItsOtherNames) {
  const TempFolder folder;
  writeRaw(
      OutputFormat::Npy, folder.file("a.npy"),
      {rawChannel<float>("P", NumberType::F32, 3, {1, 2, 3}), rawChannel<float>("pscale", NumberType::F32, 1, {0.25})});
  const ProcessResult result = mote({"info", folder.file("a.npy")});
  for (const char* part : {"P (Position)", "pscale (Radius)", "channel pscale", "(1, 2, 3) to (1, 2, 3)"})
    EXPECT_TRUE(contains(result.out, part));
}

TEST(MoteInfo, GoesOnBehindAFileThatIsWrongAndSaysSo) {
  const TempFolder folder;
  writeRaw(OutputFormat::Prt1, folder.file("a.prt"), ball());
  writeBytes(folder.file("b.prt"), readBytes(folder.file("a.prt")).substr(0, 300));
  writeRaw(OutputFormat::Prt1, folder.file("c.prt"), ball());
  const ProcessResult result = mote({"info", folder.file("a.prt"), folder.file("b.prt"), folder.file("c.prt")});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.out, "a.prt: PRT 1.1"));
  EXPECT_TRUE(contains(result.out, "c.prt: PRT 1.1"));
  EXPECT_TRUE(contains(result.err, "b.prt: particle data"));
  EXPECT_TRUE(contains(result.err, "1 of 3 files"));
}

}  // namespace
}  // namespace mote::test
