// NPY: what the reader accepts and refuses. Files are put together here byte by byte.
#include "host/particles/formats/npy_reader.h"

#include <gtest/gtest.h>

#include "host/core/log.h"
#include "host/particles/particle_loader.h"
#include "tests/support/npy_bytes.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

const std::string kTwo = rawNumbers<float>({1, 2, 3, 4, 5, 6});

TEST(NpyReader, TakesThreeColumnsForPositions) {
  for (const int major : {1, 2, 3}) {
    const OpenedFile opened(npy(dictionary("'<f4'", "(2, 3)"), kTwo, major));
    EXPECT_EQ(opened.file->count(), 2u);
    EXPECT_EQ(opened.file->format(), "NPY " + std::to_string(major) + ".0");
    EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(opened.read<dvec3>("Position"), (std::vector<dvec3>{{1, 2, 3}, {4, 5, 6}}));
  }
}

TEST(NpyReader, ReadsColumnsInFortransOrderAndBothByteOrders) {
  for (const bool big : {false, true}) {
    const std::string type = big ? "'>f8'" : "'<f8'";
    const OpenedFile rows(npy(dictionary(type, "(2, 4)"), rawNumbers<double>({1, 2, 3, 10, 4, 5, 6, 20}, big)));
    const OpenedFile columns(
        npy(dictionary(type, "(2, 4)", "True"), rawNumbers<double>({1, 4, 2, 5, 3, 6, 10, 20}, big)));
    for (const OpenedFile* opened : {&rows, &columns}) {
      EXPECT_EQ(opened->read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
      EXPECT_EQ(opened->read<float>("Density"), (std::vector<float>{10, 20}));
    }
  }
}

TEST(NpyReader, NamesFurtherColumns) {
  const OpenedFile six(npy(dictionary("'<f4'", "(1, 6)"), kTwo));
  EXPECT_EQ(six.read<vec3>("Velocity"), (std::vector<vec3>{{4, 5, 6}}));
  const OpenedFile five(npy(dictionary("'<f4'", "(1, 5)"), rawNumbers<float>({1, 2, 3, 4, 5})));
  EXPECT_EQ(five.read<float>("Column3"), std::vector<float>{4});
  EXPECT_EQ(five.read<float>("Column4"), std::vector<float>{5});
}

TEST(NpyReader, ReadsFieldsOfAnyTypeGapsIncluded) {
  const std::string descr =
      "[('Position', '<f4', (3,)), ('', '|V4'), (('a title', 'Radius'), '<f8'), ('flag', '|b1'), ('ID', '<u8')]";
  const std::string row =
      rawNumbers<float>({1, 2, 3}) + "gaps" + rawNumbers<double>({0.5}) + "\x01" + rawNumbers<std::uint64_t>({~0ull});
  const OpenedFile opened(npy(dictionary(descr, "(2,)"), row + row));
  EXPECT_EQ(describeChannels(opened.file->channels()),
            "Position (3 × float32), Radius (float64), flag (uint8), ID (uint64)");
  EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {1, 2, 3}}));
  EXPECT_EQ(opened.read<float>("Radius"), (std::vector<float>{0.5, 0.5}));
  EXPECT_EQ(opened.read<std::uint64_t>("ID"), (std::vector<std::uint64_t>{~0ull, ~0ull}));
  EXPECT_EQ(opened.read<float>("flag"), (std::vector<float>{1, 1}));
}

TEST(NpyReader, MakesVectorsOfScalarsThatAreNamedAsOne) {
  const std::string descr =
      "[('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('red', '|u1'), ('green', '|u1'), ('blue', '|u1'), ('force_x', "
      "'<f4'), "
      "('force_y', '<f4'), ('force_z', '<f4'), ('u', '<f4')]";
  const OpenedFile opened(npy(dictionary(descr, "(1,)"), rawNumbers<float>({1, 2, 3}) + "\xff" + std::string(1, '\0') +
                                                             "\x33" + rawNumbers<float>({7, 8, 9, 10})));
  EXPECT_EQ(describeChannels(opened.file->channels()),
            "Position (3 × float32), Color (3 × uint8), force (3 × float32), u (float32)");
  EXPECT_EQ(opened.read<vec3>("Color"), (std::vector<vec3>{{1, 0, 0.2f}}));
  EXPECT_EQ(opened.read<vec3>("force"), (std::vector<vec3>{{7, 8, 9}}));
}

TEST(NpyReader, ReadsARealFileThroughTheLoader) {
  ParticleSource source;
  source.file = sharedFile("npy/halo_low_res.npy");
  const ParticleSet set = loadParticles({source}, 1);
  ASSERT_EQ(set.size(), 32314u);
  const Bounds bounds = set.bounds();  // as its PROVENANCE has them
  EXPECT_NEAR(bounds.lo.x, 74.511, 1e-3);
  EXPECT_NEAR(bounds.lo.y, 16.157, 1e-3);
  EXPECT_NEAR(bounds.lo.z, 88.997, 1e-3);
  EXPECT_NEAR(bounds.hi.x, 78.918, 1e-3);
  EXPECT_NEAR(bounds.hi.y, 22.751, 1e-3);
  EXPECT_NEAR(bounds.hi.z, 93.188, 1e-3);
}

TEST(NpyReader, RefusesTruncationAtEveryByte) {
  const std::string whole = npy(dictionary("'<f4'", "(2, 3)"), kTwo);
  for (std::size_t size = 0; size < whole.size(); ++size) expectFileRefused(whole.substr(0, size), {"particles"});
}

TEST(NpyReader, SurvivesEveryFlippedBit) {
  expectEveryFlippedBitSurvived(npy(dictionary("[('x', '<f4'), ('y', '<f4'), ('z', '<f4')]", "(2,)"), kTwo), 24);
}

TEST(NpyReader, RefusesHostileNumbersWithoutAllocating) {
  for (const char* shape : {"(18446744073709551615, 3)", "(6148914691236517206, 3)", "(3, 18446744073709551615)",
                            "(99999999999999999999, 3)", "(4611686018427387904, 4)", "(1, 4294967296)"})
    expectFileRefused(npy(dictionary("'<f4'", shape), kTwo), {"particles"});
  expectFileRefused(npy(dictionary("[('a', '<f4', (4294967296,))]", "(1,)"), kTwo), {"a particle"});
  std::string endless = std::string("\x93NUMPY\x02\x00", 8) + "\xff\xff\xff\xff";
  expectFileRefused(endless + kTwo, {"header length"});
}

TEST(NpyReader, RefusesMoreChannelsThanAnybodyLooksThrough) {
  // Each is looked for among all of them: a million would take hours.
  expectFileRefused(npy(dictionary("'|u1'", "(0, 1000000)"), ""), {"channels", "at most 1024", "1000000"});
  std::string fields;
  for (int k = 0; k < 5000; ++k) fields += fmt::format("('a{}', '|u1'), ", k);
  expectFileRefused(npy(dictionary("[" + fields + "]", "(0,)"), "", 2), {"channels", "at most 1024", "5000"});
}

TEST(NpyReader, SaysWhatItDoesNotRead) {
  expectFileRefused(npy(dictionary("'|O'", "(2, 3)"), kTwo), {"descr", "objects"});
  expectFileRefused(npy(dictionary("'<c8'", "(2, 3)"), kTwo), {"'<c8'", "complex"});
  expectFileRefused(npy(dictionary("'<U4'", "(2, 3)"), kTwo), {"'<U4'"});
  expectFileRefused(npy(dictionary("[('p', [('x', '<f4')])]", "(2,)"), kTwo), {"fields of fields"});
  expectFileRefused(npy(dictionary("[('a', '<f4'), ('a', '<f4')]", "(2,)"), kTwo), {"different names", "'a' twice"});
  expectFileRefused(npy(dictionary("[('a', '<f4'), ('b', '>f4')]", "(2,)"), kTwo), {"byte order", "'b'"});
  expectFileRefused(npy(dictionary("'<f4'", "(6,)"), kTwo), {"columns", "three or more", "1 number a particle"});
  expectFileRefused(npy(dictionary("'<f4'", "(3, 2)"), kTwo), {"columns", "2 numbers"});
  expectFileRefused(npy(dictionary("'<f4'", "(1, 2, 3)"), kTwo), {"shape", "3 numbers"});
  expectFileRefused(npy(dictionary("'<f4'", "()"), kTwo), {"shape"});
  expectFileRefused(npy(dictionary("'<f4'", "(2, 3)"), kTwo, 4), {"NPY version", "4.0"});
  expectFileRefused(npy("{'descr': '<f4', 'shape': (2, 3)}", kTwo), {"fortran_order"});
  expectFileRefused(npy(dictionary("'<f4'", "(3, 3)"), kTwo), {"shape", "at most 2 particles of 12 bytes", "cut off"});
}

TEST(NpyReader, WarnsOfDataBehindTheLastParticle) {
  takeWarnings();
  const OpenedFile opened(npy(dictionary("'<f4'", "(1, 3)"), kTwo));
  EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}}));
  const std::vector<std::string> warnings = takeWarnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("12 bytes behind the last"), std::string::npos) << warnings[0];
}

TEST(ParticleFile, NamesTheFormatsThatAreReadWhereItKnowsNone) {
  for (const char* content : {"", "nothing that anybody knows"})
    expectFileRefused(content, {"PRT 1.0 and 1.1", "PRT 2", "NPY", "numpy.save"});
}

}  // namespace
}  // namespace mote
