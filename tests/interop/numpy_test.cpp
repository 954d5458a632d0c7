// NPY and NPZ as NumPy itself writes them: numpy.save, savez and savez_compressed of both byte orders and both orders
// of indices, from write_numpy.py, against the formulas that stand there.
#include <gtest/gtest.h>

#include "host/core/log.h"
#include "host/particles/formats/particle_file.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

constexpr std::size_t kCount = 70000;

class NumpyFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const ProcessResult written =
        runProcess({MOTE_NUMPY, "-B", std::string(MOTE_SOURCE_DIR) + "/tests/interop/write_numpy.py", folder_.path()});
    ASSERT_EQ(written.exitCode, 0) << written.err;
  }
  std::unique_ptr<ParticleFile> open(const std::string& name) const { return openParticleFile(folder_.file(name)); }
  template <class T>
  static std::vector<T> read(const ParticleFile& file, const std::string& channel) {
    std::vector<T> values;
    const ChannelRequest request{channel, &values};
    file.read({&request, 1});
    return values;
  }

  static dvec3 place(std::size_t i) { return {double(i) * 0.5, -double(i) / 8, double(i % 7)}; }
  static dvec3 speed(std::size_t i) { return {double(i % 3), double(i % 5), double(i % 11)}; }
  template <class Expected>
  static void expectAll(const ParticleFile& file, const std::string& channel, const Expected& expected) {
    using T = decltype(expected(std::size_t{}));
    const std::vector<T> values = read<T>(file, channel);
    ASSERT_EQ(values.size(), kCount) << file.path();
    for (std::size_t i = 0; i < kCount; ++i) ASSERT_EQ(values[i], expected(i)) << file.path() << ", particle " << i;
  }
  /// Radii as they are after rounding to the file's type.
  static void expectRadii(const ParticleFile& file, const std::string& channel, bool isDouble) {
    expectAll(file, channel, [&](std::size_t i) {
      const double exact = 1 / (1 + double(i));
      return isDouble ? exact : double(float(exact));
    });
  }

  TempFolder folder_;
};

TEST_F(NumpyFiles, OfEveryTypeOrderAndPackingHoldWhatNumpyPutThere) {
  for (const std::string packing : {"stored_", "packed_"})
    for (const std::string type : {"little4", "big4", "little8", "big8"})
      for (const std::string order : {"C", "F"}) {
        std::vector<std::string> warnings;
        const WarningsKept kept(warnings);
        const auto file = open(packing + type + order + ".npz");
        EXPECT_EQ(file->format(), "NPZ");
        EXPECT_EQ(file->channels().size(), 4u);
        expectAll(*file, "P", place);
        expectAll(*file, "v", speed);
        expectRadii(*file, "pscale", type.ends_with("8"));
        expectAll(*file, "id", [](std::size_t i) { return (std::uint64_t{1} << 40) + i; });
        EXPECT_EQ(file->meta("", "units")->bytes, "m²");
        EXPECT_TRUE(file->meta("", "time"));
        ASSERT_EQ(warnings.size(), 1u);
        EXPECT_NE(warnings[0].find("'objects' (Python objects"), std::string::npos) << warnings[0];

        const auto plain = open("plain_" + type + order + ".npy");
        expectAll(*plain, "Position", place);
        expectAll(*plain, "Velocity", speed);
      }
}

TEST_F(NumpyFiles, AreReadFromSeparateUnnamedAndPipedArrays) {
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  const auto parts = open("parts.npz");
  expectAll(*parts, "Position", place);
  expectRadii(*parts, "Radius", true);
  const auto unnamed = open("unnamed.npz");
  expectAll(*unnamed, "Position", place);
  expectAll(*unnamed, "Velocity", speed);
  const auto piped = open("piped.npz");
  expectAll(*piped, "P", place);
  expectRadii(*piped, "pscale", false);
}

TEST_F(NumpyFiles, OfFieldsAreReadAlikeFromNpyAndNpz) {
  for (const std::string name : {"table.npy", "table.npz"}) {
    const auto file = open(name);
    expectAll(*file, "Position", place);
    expectRadii(*file, "Radius", true);
    expectAll(*file, "flag", [](std::size_t i) { return double(i % 2 == 0); });
    expectAll(*file, "half", [](std::size_t i) { return double(i % 2048); });
  }
  EXPECT_TRUE(open("table.npz")->meta("", "box"));
}

}  // namespace
}  // namespace mote
