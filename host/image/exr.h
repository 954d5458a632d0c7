// OpenEXR 3.1 files: Mote's pictures out, and any single-part picture in.
//
// Written: channels R G B A and, as far as the image has them, AR AG AB and layers of radiance (half or float, linear,
// premultiplied), Z, optical_depth, velocity.x, velocity.y and other layers (always float: half has 11 digits, too few
// for distances). channels.h has the names. One part, scan lines from the top, data window = display window, no time
// stamps: the same input gives the same bytes, whatever the number of threads.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/image/image.h"

namespace mote {

enum class ExrPrecision { Half, Float };
enum class ExrCompression { None, Rle, Zips, Zip, Piz };  ///< all of them lossless

struct ExrOptions {
  ExrPrecision precision = ExrPrecision::Half;
  ExrCompression compression = ExrCompression::Zip;
  /// Scene → camera space (x right, y up, z forward) [scene units], for column vectors as all of glm: p' = M · p.
  /// OpenEXR multiplies row vectors, p' = p · M, and stores rows one after the other: its sixteen numbers are glm's
  /// columns, so the header holds the transpose, which is the same transform.
  std::optional<mat4> worldToCamera{};
  /// Scene → the picture: after division by w, (0,0) is the upper left and (1,1) the lower right corner. Same
  /// convention.
  std::optional<mat4> worldToNDC{};
  std::optional<double> framesPerSecond{};       ///< written as a fraction, 30000/1001 for 29.97; > 0
  std::optional<int> frame{};                    ///< written as the integer attribute "frame"
  float pixelAspectRatio = 1;                    ///< width / height of a pixel
  std::map<std::string, std::string> strings{};  ///< further attributes, "mote:stats" for example
};

/// Writes the picture: whole or not at all. Half clamps values beyond ±65504 (infinities too) to it and warns once with
/// their number; not-a-number stays. Throws as OutputFile does, and MachineError with path and bytes when the disk
/// refuses. Half costs a second picture of 8 bytes a pixel while it runs.
void writeExr(const std::string& path, const Image& image, const ExrOptions& options);

/// Reads R G B A Z of any pixel type; a picture of the display window. Missing colours are 0 (a lone Y is grey),
/// missing A is 1, missing Z leaves `depth` empty; channels without a place of their own become layers. Outside the
/// data window everything is 0 and Z is kNoDepth. Throws InputError when the file is missing, is no OpenEXR file, is
/// damaged or cut short, has none of these channels, subsamples them, or claims more than 16384 × 16384 pixels.
Image readExr(const std::string& path);

/// Every string attribute of the header. Throws InputError as readExr.
std::map<std::string, std::string> exrStrings(const std::string& path);

struct ExrChannel {
  std::string name, type;  ///< type: "half", "float" or "uint"
};
/// The channels in the file's order (by name). Throws InputError as readExr.
std::vector<ExrChannel> exrChannels(const std::string& path);

}  // namespace mote
