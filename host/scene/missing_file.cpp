#include "host/scene/missing_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <vector>

#include "host/scene/frame_path.h"
#include "host/scene/sequence.h"

namespace mote {
namespace {

namespace fs = std::filesystem;

/// Insertions, deletions and replacements from a to b (Levenshtein).
std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

std::vector<std::string> fileNames(const fs::path& folder) {
  constexpr std::size_t kEnough = 100'000;  // a message does not need more of a huge folder
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end && names.size() < kEnough;
       it.increment(error))
    if (it->path().filename().string().front() != '.') names.push_back(it->path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::string nearestNames(const std::string& pattern, const std::string& path) {
  const fs::path full(path);
  const fs::path folder = full.has_parent_path() ? full.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) return fmt::format("the folder '{}' does not exist", folder.string());
  std::vector<std::string> names = fileNames(folder);
  if (names.empty()) return fmt::format("the folder '{}' is empty", folder.string());
  if (hasFramePattern(pattern)) {
    const std::vector<int> frames = existingFrames(pattern);
    if (frames.size() == 1) return fmt::format("of this sequence only frame {} exists", frames[0]);
    if (!frames.empty())
      return fmt::format("of this sequence {} frames from {} to {} exist", frames.size(), frames.front(),
                         frames.back());
  }
  const std::string wanted = full.filename().string();
  const std::size_t shown = std::min<std::size_t>(3, names.size());
  std::stable_sort(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
    return editDistance(a, wanted) < editDistance(b, wanted);
  });
  std::string list;
  for (std::size_t i = 0; i < shown; ++i) list += fmt::format("{}'{}'", i > 0 ? ", " : "", names[i]);
  return fmt::format("nearest names in its folder: {}", list);
}

}  // namespace mote
