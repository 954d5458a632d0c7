// The numbers of a comparison, against hand-made pictures.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/core/error.h"
#include "host/image/compare.h"
#include "tests/support/picture.h"
#include "tests/support/png_pixels.h"
#include "tests/support/temp_folder.h"

namespace mote {
namespace {

using namespace test;

TEST(Compare, NumbersOfAHandMadePair) {
  Image a(4, 2), b(4, 2);
  b.at(1, 0) = vec4(0.3f, 0, 0, 0);
  b.at(3, 1) = vec4(0, -0.4f, 0, 0.005f);
  b.at(2, 1) = vec4(0.007f, 0, 0, 0);  // within 2/255 = 0.00784
  const ImageDifference d = compareImages(a, b);
  // Values are float: 1e-7 relative.
  EXPECT_NEAR(d.channel[0].rmse, std::sqrt((0.09 + 0.000049) / 8), 1e-7);
  EXPECT_NEAR(d.channel[0].mean, 0.307 / 8, 1e-7);
  EXPECT_NEAR(d.channel[0].max, 0.3, 1e-7);
  EXPECT_EQ(d.channel[0].maxX, 1);
  EXPECT_EQ(d.channel[0].maxY, 0);
  EXPECT_NEAR(d.channel[1].rmse, std::sqrt(0.16 / 8), 1e-7);
  EXPECT_EQ(d.channel[2].rmse, 0);
  EXPECT_NEAR(d.channel[3].max, 0.005, 1e-7);
  EXPECT_NEAR(d.overall.rmse, std::sqrt((0.09 + 0.000049 + 0.16 + 0.000025) / 32), 1e-7);
  EXPECT_NEAR(d.overall.mean, (0.3 + 0.007 + 0.4 + 0.005) / 32, 1e-7);
  EXPECT_NEAR(d.overall.max, 0.4, 1e-7);
  EXPECT_EQ(d.overall.maxX, 3);
  EXPECT_EQ(d.overall.maxY, 1);
  EXPECT_DOUBLE_EQ(d.within, 6.0 / 8);
  EXPECT_NEAR(d.psnr, -10 * std::log10(0.250074 / 32), 1e-5);
}

TEST(Compare, EqualPicturesHaveNoDifference) {
  const Image image = noise(20, 10, false);
  const ImageDifference d = compareImages(image, image);
  EXPECT_EQ(d.overall.rmse, 0);
  EXPECT_EQ(d.overall.max, 0);
  EXPECT_EQ(d.within, 1);
  EXPECT_EQ(d.psnr, std::numeric_limits<double>::infinity());
  EXPECT_SAYS(differenceJson(d), "\"psnr\": null");
}

TEST(Compare, EveryChannelCountsForWithin) {
  for (int channel = 0; channel < 4; ++channel) {
    Image a(2, 1), b(2, 1);
    b.at(0, 0)[channel] = 0.0079f;
    EXPECT_EQ(compareImages(a, b).within, 0.5) << channel;
    b.at(0, 0)[channel] = 0.0078f;
    EXPECT_EQ(compareImages(a, b).within, 1) << channel;
  }
}

TEST(Compare, NotFinitePixelsAreCountedAndLeftOut) {
  Image a(4, 1), b(4, 1);
  a.at(0, 0).x = kNan;
  a.at(1, 0).y = kInfinity, b.at(1, 0).y = kInfinity;
  b.at(1, 0).w = kNan;
  b.at(2, 0).x = 0.5f;
  const ImageDifference d = compareImages(a, b);
  EXPECT_EQ(d.channel[0].notFinite, 1u);
  EXPECT_EQ(d.channel[1].notFinite, 1u);
  EXPECT_EQ(d.channel[3].notFinite, 1u);
  EXPECT_EQ(d.overall.notFinite, 2u);
  EXPECT_DOUBLE_EQ(d.channel[0].rmse, std::sqrt(0.25 / 2));  // the two finite pixels
  EXPECT_DOUBLE_EQ(d.overall.rmse, std::sqrt(0.25 / 8));
  EXPECT_DOUBLE_EQ(d.within, 0.25);
}

TEST(Compare, LayersAreHeldAgainstEachOtherByName) {
  Image a = layered(4, 1), b = layered(4, 1);
  EXPECT_TRUE(failuresOf(compareImages(a, b)).empty());
  for (const LayerDifference& layer : compareImages(a, b).layers) {
    EXPECT_EQ(layer.channel.max, 0) << layer.name;
    EXPECT_EQ(layer.within, 1) << layer.name;
  }
  a.depth = {kNoDepth, kNoDepth, 3, 4};
  b.depth = {kNoDepth, 2, 3, 4.5f};
  b.layers[1].name = "shadow.rim";
  b.opticalDepth[2] += 0.25f;
  const ImageDifference d = compareImages(a, b);
  EXPECT_EQ(d.onlyInFirst, std::vector<std::string>{"shadow.key"});
  EXPECT_EQ(d.onlyInSecond, std::vector<std::string>{"shadow.rim"});
  const auto layer = [&](const std::string& name) {
    for (const LayerDifference& l : d.layers)
      if (l.name == name) return l;
    return LayerDifference{};
  };
  EXPECT_EQ(layer("Z").unmatched, 1u);
  EXPECT_EQ(layer("Z").within, 0.5);
  EXPECT_EQ(layer("Z").channel.max, 0.5);
  EXPECT_EQ(layer("optical_depth").within, 0.75);
  EXPECT_NEAR(layer("optical_depth").channel.max, 0.25, 1e-6);
  EXPECT_EQ(layer("optical_depth").channel.maxX, 2);
  EXPECT_SAYS(differenceJson(d), "\"optical_depth\"");
}

TEST(Compare, SmallNumbersOfALayerAreHeldToItsOwnScale) {
  Image a = layered(4, 1), b = layered(4, 1);
  for (Image* image : {&a, &b}) image->opticalDepth = {0, 0.02f, 0.05f, 0.01f};
  const auto opticalDepth = [&] {
    for (const LayerDifference& l : compareImages(a, b).layers)
      if (l.name == "optical_depth") return l;
    return LayerDifference{};
  };
  EXPECT_NEAR(opticalDepth().scale, 0.05, 1e-8);
  EXPECT_NEAR(opticalDepth().level, 0.02, 1e-8);
  b.opticalDepth[3] += 0.0003f;  // 2/255 of 0.05 is 0.00039
  EXPECT_EQ(opticalDepth().within, 1);
  b.opticalDepth[3] += 0.0002f;
  EXPECT_EQ(opticalDepth().within, 0.75);
  a.opticalDepth = {0, 0, 0, 0}, b.opticalDepth = {0, 0, 0, 7e-5f};  // 2/255 of the least scale, 0.01, is 7.8e-5
  EXPECT_EQ(opticalDepth().within, 1);
}

TEST(Compare, FailuresNameTheLayerAndWhatIsWrongWithIt) {
  const Image a = layered(4, 1);
  const auto failures = [&](const Image& b) { return failuresOf(compareImages(a, b)); };
  EXPECT_TRUE(failures(a).empty());
  Image far = a, endless = a, less = a;
  far.opticalDepth[0] += 1;
  endless.opticalDepth[1] = kNan;
  less.opticalDepth.clear();
  ASSERT_EQ(failures(far).size(), 1u);
  EXPECT_SAYS(failures(far)[0], "optical_depth: 75.0000 % of the pixels are within 2/255");
  ASSERT_EQ(failures(endless).size(), 2u);
  EXPECT_SAYS(failures(endless)[1], "optical_depth: 1 pixels are not finite");
  ASSERT_EQ(failures(less).size(), 1u);
  EXPECT_SAYS(failures(less)[0], "only the first picture has optical_depth");
  ASSERT_EQ(failuresOf(compareImages(less, a)).size(), 1u);
  EXPECT_SAYS(failuresOf(compareImages(less, a))[0], "only the second picture has optical_depth");
  // The same infinity in both is no agreement.
  Image infinite = a;
  infinite.opticalDepth[2] = kInfinity;
  EXPECT_EQ(failuresOf(compareImages(infinite, infinite)).size(), 2u);
}

TEST(Compare, DifferentSizesAreRefusedWithBoth) {
  const std::string message = messageOf<InputError>([] { compareImages(Image(4, 3), Image(3, 4)); });
  EXPECT_SAYS(message, "4 × 3");
  EXPECT_SAYS(message, "3 × 4");
  const TempFolder folder;
  EXPECT_THROW(writeDifferencePng(folder.file("d.png"), Image(4, 3), Image(3, 4)), InputError);
  EXPECT_TRUE(folder.entries().empty());
}

TEST(Compare, DifferencePictureShowsWhereAndHowMuch) {
  const TempFolder folder;
  Image a(4, 1), b(4, 1);
  b.at(1, 0) = vec4(0.1f, 0, 0, 0);
  b.at(2, 0) = vec4(0, 0, -9, 0.05f);
  b.at(3, 0).x = kNan;
  writeDifferencePng(folder.file("d.png"), a, b, 2);
  EXPECT_EQ(readPng(folder.file("d.png")).bytes,
            (std::vector<std::uint8_t>{0, 0, 0, 51, 0, 0, 26, 26, 255, 255, 0, 255}));  // 0.2·255, 0.1·255 = 25.5
}

}  // namespace
}  // namespace mote
