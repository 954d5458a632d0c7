// Tables in text: what the reader accepts and refuses.
#include "host/particles/formats/csv_reader.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host/particles/particle_loader.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

TEST(CsvReader, ReadsColumnsHoweverTheyAreParted) {
  for (const char* table :
       {"1,2,3,10\n4,5,6,20\n", "1, 2, 3, 10\r\n4, 5, 6, 20", "1;2;3;10\n4;5;6;20\n", "1\t2\t3\t10\n4\t5\t6\t20\n",
        "  1 2  3 10 \n\n# a remark\n4 5\t6 20\n", "\xef\xbb\xbf\"1\",\"2\",+3,1e1\n4,5.0,6,2E+1\n"}) {
    const OpenedFile opened(table);
    EXPECT_EQ(opened.file->format(), "CSV") << table;
    EXPECT_EQ(opened.file->count(), 2u) << table;
    EXPECT_EQ(opened.read<vec3>("Position"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}})) << table;
    EXPECT_EQ(opened.read<float>("Density"), (std::vector<float>{10, 20})) << table;
  }
}

TEST(CsvReader, TakesNamesAndTypesFromAHeader) {
  const OpenedFile opened("x,y,z,uint64 ID,\"temperature\"\n1,2,3,7,-0.5\n4,5,6,4294967296,nan\n");
  EXPECT_EQ(opened.file->format(), "CSV with a header");
  EXPECT_EQ(describeChannels(opened.file->channels()), "Position (3 × float64), ID (uint64), temperature (float64)");
  EXPECT_EQ(opened.read<dvec3>("Position"), (std::vector<dvec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(opened.read<std::uint64_t>("ID"), (std::vector<std::uint64_t>{7, 1ull << 32}));
  EXPECT_TRUE(std::isnan(opened.read<float>("temperature")[1]));
}

TEST(CsvReader, ReadsTheFilesOfKrakatoasMakers) {
  const std::unique_ptr<ParticleFile> halves = openParticleFile(sharedFile("csv/float16.csv"));
  EXPECT_EQ(halves->count(), 9u);
  EXPECT_EQ(describeChannels(halves->channels()), "Position (3 × float16)");
  std::vector<vec3> position;
  const ChannelRequest request{"Position", &position};
  halves->read({&request, 1});
  EXPECT_EQ(position[0], vec3(11, 12, 44));
  EXPECT_NEAR(position[3].y, 4.1, 2e-3);  // a float16

  std::vector<dvec3> far;
  std::vector<vec3> color;
  const std::unique_ptr<ParticleFile> offset = openParticleFile(sharedFile("csv/singleplusoffset.csv"));
  const ChannelRequest requests[] = {{"Position", &far}, {"Color", &color}};
  offset->read(requests);
  EXPECT_EQ(far[2], dvec3(100000010, 600, 401000002));
  EXPECT_EQ(color[4], vec3(0, 0, 0.0001f));

  ParticleSource source;
  source.file = sharedFile("csv/hdri_colors.csv");
  source.radius = {RadiusRule::Kind::Number};
  source.radius.value = 0.1f;
  const ParticleSet set = loadParticles({source}, 1);
  ASSERT_EQ(set.size(), 4u);
  EXPECT_EQ(set.color[0], vec3(5, 3, 1));
  EXPECT_THROW(openParticleFile(sharedFile("csv/malicious_whitespace_after_quote.csv")), InputError);
}

TEST(CsvReader, NamesLineAndColumnOfWhatIsWrong) {
  expectFileRefused("1,2,3\n4,5,6\n# remark\n7,eight,9\n", {"line 4, column 2", "a number", "'eight'"});
  expectFileRefused("x,y,z\n1,2,3\n4,5,\n", {"line 3, column 3 (z)", "''"});
  expectFileRefused("1,2,3\n4,5\n", {"line 2", "3 columns", "2"});
  expectFileRefused("1,2,3\n4,5,6,7\n", {"line 2", "3 columns", "4"});
  expectFileRefused("x,y,,z\n1,2,3,4\n", {"header, column 3", "a name"});
  expectFileRefused("a,b,a\n1,2,3\n", {"header, column 3", "side by side", "'a' again"});
  expectFileRefused("float16 P,float32 P,float32 P\n1,2,3\n", {"of one type", "'P' again"});
  expectFileRefused("1,2,3\n" + std::string(70000, '1') + ",2,3\n", {"line 2", "65536 characters"});
}

TEST(CsvReader, LeavesOtherTextsAlone) {
  for (const char* text :
       {"1,2\n3,4\n", "Dear all,\nthe numbers, 1, 2 and 3\n", "{\"mote\": 1}\n", "v 1 2 3\nv 4 5 6\n"})
    expectFileRefused(text, {"a format that Mote reads", "CSV"});
}

TEST(CsvReader, TakesFromACutTableNoMoreThanItsWholeRows) {
  const std::string whole = "x y z ID\n1 2 3 10\n4 5 6 20\n";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    SCOPED_TRACE(size);
    const std::size_t rows = size < whole.find("10") + 1 ? 0 : size < whole.find("20") + 1 ? 1 : 2;
    const bool between = size <= whole.find('4') && rows == 1;  // else a row lacks numbers
    if (rows == 2 || between)
      EXPECT_EQ(OpenedFile(whole.substr(0, size)).file->count(), rows);
    else
      expectFileRefused(whole.substr(0, size), {"particles"});
  }
}

TEST(CsvReader, SurvivesEveryFlippedBit) { expectEveryFlippedBitSurvived("x y z ID\n1 2 3 10\n4 5 6 20\n", 4); }

TEST(CsvReader, ReadsLinesThatCrossTheEndsOfItsBuffer) {
  std::string table;
  for (int i = 0; i < 100000; ++i) table += std::to_string(i) + " " + std::to_string(2 * i) + " 0.12345678901234567\n";
  const OpenedFile opened(table);
  const std::vector<dvec3> position = opened.read<dvec3>("Position");
  ASSERT_EQ(position.size(), 100000u);
  for (int i = 0; i < 100000; ++i)
    ASSERT_EQ(position[static_cast<std::size_t>(i)], dvec3(i, 2 * i, 0.12345678901234567));
}

}  // namespace
}  // namespace mote
