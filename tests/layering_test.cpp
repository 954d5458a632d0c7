// The rooms of the repository and who may see whom (docs/architecture.md): tools, tests → engine → host →
// shaders/glsl/layout. Read from the #include lines of the source tree, and for host's modules from CMake.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temp_folder.h"

namespace mote {
namespace {

namespace fs = std::filesystem;

struct Include {
  std::string file;  // relative to the root, '/' between folders
  int line = 0;
  std::string name;                   // as written, without its brackets or quotes
  std::optional<std::string> target;  // the file of ours that it names, relative to the root
  std::string place() const { return file + ":" + std::to_string(line) + ": #include " + name; }
};

std::string slurp(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The file of ours that an #include means: beside the one that has it, from the root, or from the shaders' folder.
std::optional<std::string> resolve(const fs::path& root, const fs::path& from, const std::string& name) {
  for (const fs::path& base : {from.parent_path(), root, root / "shaders/glsl"})
    if (const fs::path path = (base / name).lexically_normal(); fs::is_regular_file(path))
      return path.lexically_relative(root).generic_string();
  return std::nullopt;
}

bool isSource(const fs::path& path) {
  static const std::set<std::string> extensions{".h", ".cpp", ".c", ".glsl", ".comp", ".vert", ".geom", ".frag"};
  return extensions.contains(path.extension().string());
}

/// What a line includes, without its brackets or quotes; "" for any other line.
std::string includedName(const std::string& line) {
  std::istringstream words(line);
  std::string word, rest;
  if (!(words >> word) || !word.starts_with('#')) return "";
  if (word == "#") words >> word, word = "#" + word;  // "#  include"
  std::getline(words, rest);
  rest = word.substr(std::min<std::size_t>(word.size(), 8)) + rest;  // #include"a.h" has no blank
  const std::size_t open = rest.find_first_of("<\"");
  if (!word.starts_with("#include") || open == std::string::npos) return "";
  const std::size_t close = rest.find_first_of(">\"", open + 1);
  return rest.substr(open + 1, close - open - 1);
}

/// Every #include of every source file below the rooms' folders, in a fixed order.
std::vector<Include> includesBelow(const fs::path& root) {
  std::vector<fs::path> files;
  for (const char* room : {"tools", "tests", "engine", "host", "shaders"})
    if (fs::is_directory(root / room))
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room))
        if (entry.is_regular_file() && isSource(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());

  std::vector<Include> found;
  for (const fs::path& file : files) {
    std::istringstream text(slurp(file));
    std::string line;
    for (int number = 1; std::getline(text, line); ++number)
      if (const std::string name = includedName(line); !name.empty())
        found.push_back({file.lexically_relative(root).generic_string(), number, name, resolve(root, file, name)});
  }
  return found;
}

/// The room that a file stands in: its first folder, with the two halves of shaders/ told apart.
std::string roomOf(const std::string& file) {
  if (file.starts_with("shaders/glsl/layout/")) return "shaders/glsl/layout";
  return file.substr(0, file.find('/'));
}

/// The module of a file of host, "core" for host/core/error.h; "" elsewhere.
std::string moduleOf(const std::string& file) {
  if (!file.starts_with("host/")) return "";
  return file.substr(5, file.find('/', 5) - 5);
}

/// Includes from a room that its own row does not name.
std::vector<std::string> brokenDirections(const std::vector<Include>& includes) {
  const std::string layout = "shaders/glsl/layout";
  const std::map<std::string, std::set<std::string>> allowed{{"tools", {"tools", "engine", "host", layout}},
                                                             {"tests", {"tests", "engine", "host", layout}},
                                                             {"engine", {"engine", "host", layout}},
                                                             {"host", {"host", layout}},
                                                             {"shaders", {"shaders", layout}},
                                                             {layout, {layout}}};
  std::vector<std::string> broken;
  for (const Include& include : includes)
    if (include.target && !allowed.at(roomOf(include.file)).contains(roomOf(*include.target)))
      broken.push_back(include.place() + ": " + roomOf(include.file) + " may not see " + roomOf(*include.target));
  return broken;
}

/// Vulkan headers, and the SPIR-V that only Vulkan can use, in rooms that have to work without a driver. The headers
/// are the engine's alone; its tests may look at them.
std::vector<std::string> vulkanOutsideEngine(const std::vector<Include>& includes) {
  std::vector<std::string> broken;
  for (const Include& include : includes) {
    const std::string room = roomOf(include.file);
    if (room == "engine" || room == "tests" || room == "shaders") continue;
    const bool vulkan = include.name.starts_with("vulkan/") || include.name.starts_with("volk");
    if (vulkan || include.name == "spirv.h") broken.push_back(include.place() + ": Vulkan belongs to engine");
  }
  return broken;
}

/// What CMake says of host: its modules in the order of host/CMakeLists.txt, and for each the modules it links.
struct HostModules {
  std::vector<std::string> order;
  std::map<std::string, std::set<std::string>> links;

  /// The modules that `module` may include: those it links, and those that come with them.
  std::set<std::string> reachable(const std::string& module) const {
    std::set<std::string> seen{module};
    std::vector<std::string> open{module};
    while (!open.empty()) {
      const std::string current = open.back();
      open.pop_back();
      const auto found = links.find(current);
      if (found == links.end()) continue;
      for (const std::string& next : found->second)
        if (seen.insert(next).second) open.push_back(next);
    }
    return seen;
  }
};

/// The word that follows each `prefix`, in order: letters, digits and '_'.
std::vector<std::string> wordsAfter(const std::string& text, const std::string& prefix) {
  std::vector<std::string> found;
  for (std::size_t at = text.find(prefix); at != std::string::npos; at = text.find(prefix, at + 1)) {
    const auto begin = text.begin() + static_cast<std::ptrdiff_t>(at + prefix.size());
    found.emplace_back(begin,
                       std::find_if(begin, text.end(), [](unsigned char c) { return !std::isalnum(c) && c != '_'; }));
  }
  return found;
}

HostModules hostModules(const fs::path& root) {
  HostModules modules;
  modules.order = wordsAfter(slurp(root / "host/CMakeLists.txt"), "add_subdirectory(");
  for (const std::string& module : modules.order) {
    const std::string text = slurp(root / "host" / module / "CMakeLists.txt");
    for (const std::string& link : wordsAfter(text, "mote_"))
      if (link != "module" && link != "options") modules.links[module].insert(link);
  }
  return modules;
}

std::vector<std::string> brokenModules(const HostModules& modules, const std::vector<Include>& includes) {
  std::vector<std::string> broken;
  for (const Include& include : includes) {
    const std::string from = moduleOf(include.file), to = include.target ? moduleOf(*include.target) : "";
    if (from.empty() || to.empty() || modules.reachable(from).contains(to)) continue;
    broken.push_back(include.place() + ": host/" + from + "/CMakeLists.txt does not link mote_" + to);
  }
  return broken;
}

/// Links to a module that does not stand above, which also means to itself or in a circle.
std::vector<std::string> brokenOrder(const HostModules& modules) {
  std::vector<std::string> broken;
  std::set<std::string> above;
  for (const std::string& module : modules.order) {
    if (const auto found = modules.links.find(module); found != modules.links.end())
      for (const std::string& link : found->second)
        if (!above.contains(link)) broken.push_back("host/" + module + " links " + link + ", which is not above it");
    above.insert(module);
  }
  return broken;
}

/// First column of the code block below README's "## Folders", one path a line.
std::vector<std::string> readmeFolders(const std::string& readme) {
  std::vector<std::string> paths;
  const std::size_t heading = readme.find("\n## Folders\n");
  if (heading == std::string::npos) return paths;
  const std::size_t open = readme.find("```", heading), close = readme.find("\n```", open + 3);
  if (open == std::string::npos || close == std::string::npos) return paths;
  std::istringstream block(readme.substr(open, close - open));
  std::string line, path;
  std::getline(block, line);  // ``` and what follows it
  while (std::getline(block, line))
    if (std::istringstream(line) >> path && !line.starts_with(' ')) paths.push_back(path);
  return paths;
}

void expectNone(const std::vector<std::string>& broken) {
  for (const std::string& line : broken) ADD_FAILURE() << line;
}

const fs::path kRoot = fs::path(MOTE_SOURCE_DIR).lexically_normal();

/// Those of this source tree.
const std::vector<Include>& ownIncludes() {
  static const std::vector<Include> includes = includesBelow(kRoot);
  return includes;
}

TEST(Layering, FindsIncludesInEveryRoom) {
  std::set<std::string> rooms;
  for (const Include& include : ownIncludes())
    if (include.target) rooms.insert(roomOf(include.file));
  EXPECT_EQ(rooms, (std::set<std::string>{"tools", "tests", "engine", "host", "shaders", "shaders/glsl/layout"}));
}

TEST(Layering, DependenciesPointOneWay) { expectNone(brokenDirections(ownIncludes())); }

TEST(Layering, OnlyTheEngineSeesVulkan) { expectNone(vulkanOutsideEngine(ownIncludes())); }

TEST(Layering, HostModulesIncludeOnlyWhatTheyLink) {
  const HostModules modules = hostModules(kRoot);
  std::set<std::string> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(kRoot / "host"))
    if (entry.is_directory()) folders.insert(entry.path().filename().string());
  EXPECT_EQ(std::set<std::string>(modules.order.begin(), modules.order.end()), folders);
  expectNone(brokenModules(modules, ownIncludes()));
}

TEST(Layering, HostModulesLinkOnlyThoseAboveThem) { expectNone(brokenOrder(hostModules(kRoot))); }

TEST(Layering, ReadmeFolderMapIsTrue) {
  const std::vector<std::string> named = readmeFolders(slurp(kRoot / "README.md"));
  for (const std::string& path : named) EXPECT_TRUE(fs::is_directory(kRoot / path)) << "README.md names " << path;
  for (const char* room : {"host/", "engine/", "shaders/glsl/", "tools/", "tests/", "scenes/", "docs/"})
    EXPECT_NE(std::find(named.begin(), named.end(), room), named.end()) << "README.md leaves out " << room;
}

// The checks themselves, on a tree that breaks every rule once.
TEST(Layering, ReportsEachKindOfBreach) {
  const test::TempFolder folder;
  const auto write = [&](const std::string& path, const std::string& text) {
    fs::create_directories(fs::path(folder.file(path)).parent_path());
    test::writeBytes(folder.file(path), text);
  };
  write("engine/frame.h", "");
  write("tools/render.h", "#include <vulkan/vulkan.h>\n#include \"engine/frame.h\"\n");
  write("tests/frame_test.cpp", "// #include \"tools/gone.h\"\n#include<string>\n#include \"tools/render.h\"\n");
  write("shaders/glsl/layout/types.h", "#include \"../lib/walk.glsl\"\n");
  write("shaders/glsl/lib/walk.glsl", "#include \"../layout/types.h\"\n");
  write("host/CMakeLists.txt", "add_subdirectory(core)\nadd_subdirectory(image)\nadd_subdirectory(splat)\n");
  write("host/core/CMakeLists.txt", "mote_module(core PUBLIC mote_image)\n");
  write("host/image/CMakeLists.txt", "mote_module(image)\n");
  write("host/splat/CMakeLists.txt", "mote_module(splat PUBLIC mote_core)\n");
  write("host/core/error.h", "  #  include <volk.h>\n#include \"engine/frame.h\"  // upward\n");
  write("host/image/image.h", "#include \"host/core/error.h\"\n");
  write("host/splat/splat.h", "#include \"host/image/image.h\"\n#include \"host/core/error.h\"\n");

  const std::vector<Include> includes = includesBelow(folder.path());
  EXPECT_EQ(brokenDirections(includes),
            (std::vector<std::string>{
                "host/core/error.h:2: #include engine/frame.h: host may not see engine",
                "shaders/glsl/layout/types.h:1: #include ../lib/walk.glsl: shaders/glsl/layout may not see shaders",
                "tests/frame_test.cpp:3: #include tools/render.h: tests may not see tools"}));
  EXPECT_EQ(vulkanOutsideEngine(includes),
            (std::vector<std::string>{"host/core/error.h:1: #include volk.h: Vulkan belongs to engine",
                                      "tools/render.h:1: #include vulkan/vulkan.h: Vulkan belongs to engine"}));
  const HostModules modules = hostModules(folder.path());
  EXPECT_EQ(
      brokenModules(modules, includes),
      (std::vector<std::string>{
          "host/image/image.h:1: #include host/core/error.h: host/image/CMakeLists.txt does not link mote_core"}));
  EXPECT_EQ(brokenOrder(modules), (std::vector<std::string>{"host/core links image, which is not above it"}));
}

}  // namespace
}  // namespace mote
