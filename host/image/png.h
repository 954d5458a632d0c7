// PNG: the preview, an 8-bit sRGB picture of a linear one, and reading of maps.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "host/image/image.h"

namespace mote {

/// IEC 61966-2-1 encoding of a linear value, clipped to [0, 1]: 0–255, rounded to nearest. Not-a-number gives 0.
std::uint8_t encodeSrgb(float linear);

/// The picture over black (colour is premultiplied, so alpha drops out), times 2^exposure [EV, stops], clipped to [0,
/// 1], sRGB-encoded, with the sRGB chunk that says so; no time stamp. Whole or not at all. Throws as OutputFile does,
/// and MachineError with path and bytes when the disk refuses.
void writePng(const std::string& path, const Image& image, float exposure = 0);

/// Writes bytes as they are: width × height × RGB, rows from the top. Throws as writePng.
void writePngBytes(const std::string& path, const std::vector<std::uint8_t>& rgb, int width, int height);

/// What the numbers of a PNG mean.
enum class PngValues {
  Color,  ///< sRGB: becomes linear
  Data,   ///< a measure: 0 to 1 as it stands
};

/// Any PNG of up to 16 bits a channel: RGB as `values` says, whatever a gAMA or ICC chunk says; not premultiplied; A as
/// it stands, 1 where there is none. Throws InputError for a file that is missing, is no PNG, or is larger than 16384 ×
/// 16384.
Image readPng(const std::string& path, PngValues values);

}  // namespace mote
