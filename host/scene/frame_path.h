// Frame numbers in file names, and the small grammars of --frames and --size.
#pragma once
#include <string>
#include <string_view>

#include "host/core/vec.h"

namespace mote {

/// Frame numbers lie in ±this, so that loops over frames cannot overflow an int.
constexpr int kMaxFrame = 9'999'999;

/// True if the file name (what follows the last '/') of `pattern` has a '#', a "%d" or a "%04d" (%0 and a width up to
/// 99). Folders may be named with one.
bool hasFramePattern(std::string_view pattern);

/// Replaces it (all of a run of '#') by the frame number, zero-padded to at least the run's length or the width; the
/// sign of a negative frame stands before the zeros and counts as one place ("a.####.exr", -7 → "a.-007.exr", as
/// printf's %04d). A pattern without one comes back unchanged. Throws InputError when the file name has more than one.
std::string framePath(std::string_view pattern, int frame);

/// True where framePath(pattern, frame) is `path` for some frame.
bool isFrameOf(std::string_view pattern, std::string_view path);

/// What stands before the frame number, folder included, and after it; all of it before, where there is none.
struct FramePatternParts {
  std::string head, tail;
};
FramePatternParts framePatternParts(std::string_view pattern);

/// Frames first, first + step, … up to last; last ≥ first, step ≥ 1; all within ±kMaxFrame.
struct FrameRange {
  int first = 1, last = 1, step = 1;
};

/// "A", "A-B" or "A-BxS"; A and B may be negative ("-5--2"). Throws InputError naming `--frames`.
FrameRange parseFrameRange(std::string_view text);

/// "WxH" in pixels, 1 … 16384 each. Throws InputError naming `--size`.
ivec2 parseSize(std::string_view text);

}  // namespace mote
