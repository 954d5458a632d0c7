// mote compare: exit codes, its report, and what it refuses.
#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "tests/cli/mote_program.h"

namespace mote {
namespace {

using nlohmann::json;
using test::contains;
using test::ProcessResult;
using test::readBytes;
using test::TempFolder;
using Arguments = std::vector<std::string>;

Image flatImage(int width, int height, float value) {
  Image image(width, height);
  for (vec4& pixel : image.pixels) pixel = vec4(value, value, value, 1);
  return image;
}

TEST(MoteCompare, EqualPicturesAreExitCode0) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  const ProcessResult result = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), "--report",
                                           folder.file("r.json"), "--diff", folder.file("d.png")});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "no difference"));
  const json report = json::parse(readBytes(folder.file("r.json")));
  EXPECT_EQ(report["rmse"], 0);
  EXPECT_EQ(report["passed"], true);
  EXPECT_EQ(readBytes(folder.file("d.png")).substr(1, 3), "PNG");
}

TEST(MoteCompare, DifferentPicturesAreExitCode1AndTheReportIsWritten) {
  const TempFolder folder;
  Image other = flatImage(8, 4, 0.5f);
  other.at(3, 2).g = 0.75f;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  writeExr(folder.file("b.exr"), other, {});
  const Arguments compare{"compare", folder.file("a.exr"), folder.file("b.exr"), "--report", folder.file("r.json")};
  const ProcessResult result = test::mote(compare);
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(contains(result.out, "differs: RMSE"));
  const json report = json::parse(readBytes(folder.file("r.json")));
  EXPECT_EQ(report["passed"], false);
  EXPECT_EQ(report["failures"].size(), 2u);
  EXPECT_DOUBLE_EQ(report["channels"]["G"]["max"], 0.25);  // exact in half
  EXPECT_EQ(report["channels"]["G"]["max_at"], (json{3, 2}));
  // RMSE over all four channels: √(0.25² / 128) = 0.0221; 31 of 32 pixels agree.
  Arguments tolerant = compare;
  tolerant.insert(tolerant.end(), {"--max-rmse", "0.0222", "--within", "0.96"});
  EXPECT_EQ(test::mote(tolerant).exitCode, 0);
  Arguments strict = compare;
  strict.insert(strict.end(), {"--max-rmse", "0.0220", "--within", "0.96"});
  EXPECT_EQ(test::mote(strict).exitCode, 1);
}

TEST(MoteCompare, NotFinitePixelsNeverPass) {
  const TempFolder folder;
  Image image = flatImage(100, 100, 0.5f);
  image.at(1, 1).r = std::numeric_limits<float>::quiet_NaN();
  writeExr(folder.file("a.exr"), image, {});
  const ProcessResult result = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), "--within", "0"});
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_TRUE(contains(result.out, "1 pixels are not finite"));
}

TEST(MoteCompare, ALayerThatOnlyOnePictureHasFails) {
  const TempFolder folder;
  Image more = flatImage(8, 4, 0.5f);
  more.opticalDepth.assign(32, 0.25f);
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  writeExr(folder.file("b.exr"), more, {});
  const std::pair<const char*, std::array<std::string, 2>> cases[] = {
      {"second", {folder.file("a.exr"), folder.file("b.exr")}},
      {"first", {folder.file("b.exr"), folder.file("a.exr")}}};
  for (const auto& [which, files] : cases) {
    const ProcessResult result = test::mote({"compare", files[0], files[1], "--report", folder.file("r.json")});
    EXPECT_EQ(result.exitCode, 1) << result.out;
    EXPECT_TRUE(contains(result.out, fmt::format("differs: only the {} picture has optical_depth", which)));
    const json report = json::parse(readBytes(folder.file("r.json")));
    EXPECT_EQ(report["passed"], false);
    EXPECT_EQ(report["failures"].size(), 1u);
    EXPECT_EQ(report[fmt::format("only_in_{}", which)], json{"optical_depth"});
  }
}

TEST(MoteCompare, RefusesLimitsThatAreNone) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  const std::array<std::string, 2> cases[] = {
      {"--within", "1.5"}, {"--within", "nan"}, {"--max-rmse", "-1"}, {"--max-rmse", "nan"}};
  for (const auto& [flag, value] : cases) {
    const ProcessResult result = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), flag, value});
    EXPECT_EQ(result.exitCode, 2) << flag << " " << value;
    EXPECT_TRUE(contains(result.err, flag + ": expected"));
  }
}

TEST(MoteCompare, PicturesOfDifferentSizesAreBadInput) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  writeExr(folder.file("b.exr"), flatImage(4, 8, 0.5f), {});
  const ProcessResult result =
      test::mote({"compare", folder.file("a.exr"), folder.file("b.exr"), "--report", folder.file("r.json")});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, folder.file("b.exr") + ": size: expected 8 × 4"));
  EXPECT_FALSE(std::filesystem::exists(folder.file("r.json")));
}

TEST(MoteCompare, MissingPicturesAndFoldersAreBadInputAndNothingIsWritten) {
  const TempFolder folder;
  writeExr(folder.file("a.exr"), flatImage(8, 4, 0.5f), {});
  const ProcessResult missing = test::mote({"compare", folder.file("a.exr"), folder.file("gone.exr")});
  EXPECT_EQ(missing.exitCode, 2);
  EXPECT_TRUE(contains(missing.err, "gone.exr"));
  const ProcessResult noFolder = test::mote({"compare", folder.file("a.exr"), folder.file("a.exr"), "--report",
                                             folder.file("r.json"), "--diff", folder.file("no/d.png")});
  EXPECT_EQ(noFolder.exitCode, 2);
  EXPECT_TRUE(contains(noFolder.err, folder.file("no")));
  EXPECT_EQ(folder.entries(), std::vector<std::string>{"a.exr"});
}

}  // namespace
}  // namespace mote
