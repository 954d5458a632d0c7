#include "host/scene/frame_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "host/core/error.h"

namespace mote {
namespace {

// Images wider than this do not exist on lavapipe, and the splat pass renders a frame as one image.
constexpr int kMaxImageSize = 16384;

/// Takes an integer from the front of `text`; nothing (and `text` as it was) where none stands or it exceeds int.
std::optional<int> takeInteger(std::string_view& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool take(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

std::size_t nameBegin(std::string_view path) { return path.rfind('/') + 1; }  // npos + 1 is 0: the whole path

/// Where the frame number stands, and how many digits it has at least.
struct FramePattern {
  std::size_t begin, end;
  std::size_t width;
};

/// "%d" or "%0Nd" at `at`.
std::optional<FramePattern> percentPattern(std::string_view text, std::size_t at) {
  std::size_t end = at + 1, width = 0;
  if (end < text.size() && text[end] == '0')
    // Two digits: no name is longer than 99.
    for (++end; end < text.size() && end <= at + 3 && text[end] >= '0' && text[end] <= '9'; ++end)
      width = 10 * width + static_cast<std::size_t>(text[end] - '0');
  if (end >= text.size() || text[end] != 'd' || (end > at + 1 && width == 0)) return std::nullopt;
  return FramePattern{at, end + 1, width};
}

/// The first at or after `from`.
std::optional<FramePattern> findPattern(std::string_view text, std::size_t from) {
  for (std::size_t at = from; (at = text.find_first_of("#%", at)) != std::string_view::npos; ++at) {
    if (text[at] == '#') {
      const std::size_t end = std::min(text.find_first_not_of('#', at), text.size());
      return FramePattern{at, end, end - at};
    }
    if (const auto found = percentPattern(text, at)) return found;
  }
  return std::nullopt;
}

std::string quoted(std::string_view text) { return fmt::format("\"{}\"", text); }

}  // namespace

bool hasFramePattern(std::string_view pattern) { return findPattern(pattern, nameBegin(pattern)).has_value(); }

std::string framePath(std::string_view pattern, int frame) {
  const auto found = findPattern(pattern, nameBegin(pattern));
  if (!found) return std::string(pattern);
  if (findPattern(pattern, found->end))
    throw InputError(pattern, "", "one run of # (or one %04d) for the frame number", "several",
                     "write it as name.####.prt");
  return fmt::format("{}{:0{}}{}", pattern.substr(0, found->begin), frame, found->width, pattern.substr(found->end));
}

bool isFrameOf(std::string_view pattern, std::string_view path) {
  if (!hasFramePattern(pattern)) return path == pattern;
  const FramePatternParts parts = framePatternParts(pattern);
  if (path.size() <= parts.head.size() + parts.tail.size() || !path.starts_with(parts.head)) return false;
  std::string_view number = path.substr(parts.head.size());
  const std::optional<int> frame = takeInteger(number);
  return frame && framePath(pattern, *frame) == path;
}

FramePatternParts framePatternParts(std::string_view pattern) {
  const auto found = findPattern(pattern, nameBegin(pattern));
  if (!found) return {std::string(pattern), ""};
  return {std::string(pattern.substr(0, found->begin)), std::string(pattern.substr(found->end))};
}

FrameRange parseFrameRange(std::string_view text) {
  std::string_view rest = text;
  FrameRange range;
  const auto takeInto = [&](int& value) {
    const auto taken = takeInteger(rest);
    if (taken) value = *taken;
    return taken.has_value();
  };
  bool good = takeInto(range.first);
  range.last = range.first;
  if (good && take(rest, '-')) {
    good = takeInto(range.last);
    if (good && take(rest, 'x')) good = takeInto(range.step);
  }
  if (!good || !rest.empty())
    throw InputError("--frames", "", "frames as A, A-B or A-BxS", quoted(text), "for example 1-240 or 1-240x2");
  for (const int number : {range.first, range.last, range.step})
    if (number < -kMaxFrame || number > kMaxFrame)
      throw InputError("--frames", "", fmt::format("frame numbers from -{0} to {0}", kMaxFrame), quoted(text));
  if (range.last < range.first)
    throw InputError("--frames", "", "a last frame that is not before the first", quoted(text),
                     fmt::format("{} is before {}", range.last, range.first));
  if (range.step < 1) throw InputError("--frames", "", "a step of at least 1", quoted(text));
  return range;
}

ivec2 parseSize(std::string_view text) {
  const std::string expected = fmt::format("a picture size as WxH in pixels, each 1 to {}", kMaxImageSize);
  std::string_view rest = text;
  const auto width = takeInteger(rest);
  const bool cross = width && take(rest, 'x');
  const auto height = cross ? takeInteger(rest) : std::nullopt;
  const auto inRange = [](int value) { return value >= 1 && value <= kMaxImageSize; };
  if (!height || !rest.empty() || !inRange(*width) || !inRange(*height))
    throw InputError("--size", "", expected, quoted(text), "for example 1280x720");
  return {*width, *height};
}

}  // namespace mote
