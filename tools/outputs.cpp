#include "tools/outputs.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>

#include "host/core/log.h"
#include "host/core/output_file.h"
#include "host/scene/frame_path.h"

namespace mote {
namespace {

void tidy(const std::string& pattern,
          const std::function<bool(const std::string& names, const std::string& name)>& fits) {
  const std::filesystem::path path(pattern);
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  const std::string names = path.filename().string();
  const std::size_t removed =
      removeStaleTemporaries(folder, [&](const std::string& name) { return fits(names, name); });
  if (removed > 0) logInfo(fmt::format("{}: {} temporary files of killed runs removed", pattern, removed));
}

}  // namespace

void prepareOutput(const std::string& path) {
  { const OutputFile probe(path); }
  tidy(path, std::equal_to<>());
}

void prepareOutputs(const std::string& pattern, int first) {
  { const OutputFile probe(framePath(pattern, first)); }
  tidy(pattern, isFrameOf);
}

}  // namespace mote
