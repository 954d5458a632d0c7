// How far two pictures are apart, in numbers and as a picture.
//
// All differences are of the raw linear values, alpha included, on the scale where 1 is 1: no exposure, no sRGB, no
// clipping. A pixel with a not-finite value in either picture is counted and left out of the errors and averages, and
// it is not "within".
#pragma once
#include <string>
#include <vector>

#include "host/image/image.h"

namespace mote {

constexpr double kPixelTolerance = 2.0 / 255.0;  ///< below what an 8-bit screen shows clearly; the limit of "within"

struct ChannelDifference {
  double rmse = 0;            ///< √ of the mean of (a − b)²
  double mean = 0;            ///< mean of |a − b|
  double max = 0;             ///< greatest |a − b| …
  int maxX = 0, maxY = 0;     ///< … and the first pixel, row by row from the top, that has it
  std::size_t notFinite = 0;  ///< pixels where a or b is not finite in this channel
};

/// One channel beyond R G B A that both pictures have. Pixels without a surface or medium (Z of kNoDepth) in exactly
/// one picture count as `unmatched` and are left out of the errors; those without in both are equal.
struct LayerDifference {
  std::string name;
  ChannelDifference channel{};
  std::size_t unmatched = 0;
  double scale = 1;   ///< greatest finite |a| or |b|, kept between kLeastLayerScale and 1
  double level = 0;   ///< mean of |a| over the pixels that both have
  double within = 1;  ///< share of all pixels that match and differ by ≤ kPixelTolerance · max(scale, |a|)
};

/// A layer whose numbers are all smaller is held to 2/255 of this: a hundredth of a pixel of motion, or of radiance 1.
constexpr double kLeastLayerScale = 0.01;

struct ImageDifference {
  int width = 0, height = 0;
  ChannelDifference channel[4];         ///< R G B A
  ChannelDifference overall;            ///< over all four channels' values; notFinite: pixels with any
  double within = 1;                    ///< share of all pixels whose R, G, B and A each differ by ≤ kPixelTolerance
  std::vector<LayerDifference> layers;  ///< in the first picture's order
  std::vector<std::string> onlyInFirst, onlyInSecond;  ///< names of channels that only one of the pictures has
  double psnr = 0;  ///< [dB] −20·log10(overall.rmse), peak value 1; +∞ for equal pictures
};

/// Throws InputError when the sizes differ. About 0.01 s a million pixels and four channels.
ImageDifference compareImages(const Image& a, const Image& b);

/// How far apart pictures may be; the defaults are what `mote crosscheck` holds CPU and GPU to.
struct CompareLimits {
  double rmse = 1e-3;     ///< of R G B A together
  double within = 0.999;  ///< least share of pixels within 2/255: of R G B A together, and of each layer by its scale
};

/// Why the pictures count as different, a sentence each: beyond the limits, pixels that are not finite, channels that
/// only one of them has. Empty where they do not.
std::vector<std::string> failuresOf(const ImageDifference& difference, const CompareLimits& limits = {});
/// The same of one layer.
std::vector<std::string> failuresOf(const LayerDifference& layer, const CompareLimits& limits = {});

/// The differences as a JSON object; a PSNR of equal pictures is null there.
std::string differenceJson(const ImageDifference& difference);

/// A PNG of gain · |a − b|, clipped to [0, 1] and not sRGB-encoded; each colour channel shows the larger of its own and
/// alpha's difference, not-finite pixels are magenta. At the default gain of 64 the tolerance of 2/255 is half of
/// white. Throws InputError when the sizes differ, and as writePng.
void writeDifferencePng(const std::string& path, const Image& a, const Image& b, float gain = 64);

}  // namespace mote
