#include "host/scene/scene_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/core/error.h"
#include "host/scene/frame_path.h"

namespace mote {
namespace {

bool isIdentifier(std::string_view name) {
  const auto letter = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_'; };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return !name.empty() && letter(name.front()) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return letter(c) || digit(c); });
}

}  // namespace

std::filesystem::path folderOf(const Scene& scene) { return std::filesystem::path(scene.path).parent_path(); }

bool readPath(ObjectReader& object, std::string_view key, std::string& path, const std::filesystem::path& folder) {
  std::string given;
  if (!object.text(key, given)) return false;
  path = (folder / given).string();  // an absolute path replaces the folder
  try {
    framePath(path, 1);
  } catch (const InputError&) {
    object.problem(key, "at most one run of # (or one %04d) for the frame number", quotedForMessage(given),
                   "as in plume.####.prt");
  }
  return true;
}

void readName(ObjectReader& object, std::string& name, std::string_view hint) {
  if (!object.text("name", name)) return;
  if (!isIdentifier(name) || name.size() > kMaxNameLength)
    object.problem(
        "name", fmt::format("a name of 1 to {} letters, digits and _ that does not begin with a digit", kMaxNameLength),
        quotedForMessage(name), hint);
}

void readBackend(ObjectReader& object, Backend& backend) {
  object.choice<Backend>("backend", backend, {{"cpu", Backend::Cpu}, {"gpu", Backend::Gpu}, {"auto", Backend::Auto}});
}

}  // namespace mote
