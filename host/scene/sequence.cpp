#include "host/scene/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/scene/frame_path.h"
#include "host/scene/missing_file.h"

namespace mote {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRanges = 12;  // in a message

/// The frame number in a file's name; none where it is not as the pattern writes it.
std::optional<int> frameIn(const std::string& name, const std::string& pattern, const FramePatternParts& parts) {
  if (name.size() <= parts.head.size() + parts.tail.size()) return std::nullopt;
  if (!name.starts_with(parts.head) || !name.ends_with(parts.tail)) return std::nullopt;
  const char *begin = name.data() + parts.head.size(), *end = name.data() + name.size() - parts.tail.size();
  int frame = 0;
  const auto [stop, error] = std::from_chars(begin, end, frame);
  if (error != std::errc{} || stop != end || framePath(pattern, frame) != name) return std::nullopt;
  return frame;
}

/// "3-5, 9-13x2": frames that are `step` apart, as --frames takes them.
class Ranges {
 public:
  explicit Ranges(int step) : step_(step) {}
  void add(int frame) {
    if (!ranges_.empty() && ranges_.back().second + step_ == frame) {
      ranges_.back().second = frame;
    } else {
      ranges_.push_back({frame, frame});
    }
    ++count_;
  }
  std::size_t count() const { return count_; }
  std::string text() const {
    std::string text;
    for (std::size_t i = 0; i < std::min(kMostRanges, ranges_.size()); ++i) {
      const auto [first, last] = ranges_[i];
      text += fmt::format("{}{}", text.empty() ? "" : ", ", first);
      if (last > first) text += fmt::format("-{}{}", last, step_ > 1 ? fmt::format("x{}", step_) : "");
    }
    if (ranges_.size() > kMostRanges) text += fmt::format(" and {} ranges more", ranges_.size() - kMostRanges);
    return text;
  }

 private:
  int step_;
  std::size_t count_ = 0;
  std::vector<std::pair<int, int>> ranges_;
};

std::string rangeText(const Frames& frames) {
  if (frames.first == frames.last) return fmt::format("frame {}", frames.first);
  return fmt::format("every frame of {}-{}{}", frames.first, frames.last,
                     frames.step > 1 ? fmt::format("x{}", frames.step) : "");
}

void checkSequence(const std::string& pattern, const Scene& scene) {
  if (!hasFramePattern(pattern)) return;
  const Frames& frames = scene.frames;
  const bool hold = scene.inputs.missing == MissingFrames::Hold;
  const std::vector<int> existing = existingFrames(pattern);
  Ranges missing(frames.step);
  for (int frame = frames.first; frame <= frames.last; frame += frames.step) {
    const bool found = hold ? !existing.empty() && existing.front() <= frame
                            : std::binary_search(existing.begin(), existing.end(), frame);
    if (!found) missing.add(frame);
  }
  if (missing.count() == 0) return;
  std::string hint = nearestNames(pattern, framePath(pattern, frames.first));
  if (!hold && !existing.empty() && existing.front() <= frames.first)
    hint += "; --missing hold takes the frame before a gap";
  throw InputError(pattern, "", fmt::format("a file for {}{}", rangeText(frames), hold ? ", or an earlier one" : ""),
                   fmt::format("none for {} {}", missing.count() == 1 ? "frame" : "frames", missing.text()), hint);
}

}  // namespace

std::vector<int> existingFrames(const std::string& pattern) {
  std::vector<int> frames;
  if (!hasFramePattern(pattern)) return frames;
  const fs::path path(pattern);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const std::string name = path.filename().string();
  const FramePatternParts parts = framePatternParts(name);
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (const auto frame = frameIn(it->path().filename().string(), name, parts)) frames.push_back(*frame);
  std::sort(frames.begin(), frames.end());
  return frames;
}

int fileFrame(const std::string& pattern, int frame, MissingFrames missing) {
  if (missing != MissingFrames::Hold || !hasFramePattern(pattern)) return frame;
  std::error_code ignored;
  if (fs::exists(framePath(pattern, frame), ignored)) return frame;
  const std::vector<int> existing = existingFrames(pattern);
  const auto next = std::upper_bound(existing.begin(), existing.end(), frame);
  if (next == existing.begin()) return frame;
  const int held = *(next - 1);
  logWarning(fmt::format("{}: no such file; frame {} is held", framePath(pattern, frame), held));
  return held;
}

void checkSequences(const Scene& scene) {
  for (const ParticleSource& source : scene.particles) checkSequence(source.file, scene);
  for (const Solid& solid : scene.solids) checkSequence(solid.file, scene);
}

}  // namespace mote
