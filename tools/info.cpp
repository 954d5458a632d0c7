// mote info: what a particle file, a picture or a scene holds.
#include "tools/info.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/image/exr.h"
#include "host/particles/formats/particle_file.h"
#include "host/scene/missing_file.h"
#include "host/scene/scene_reader.h"
#include "tools/command.h"
#include "tools/preflight.h"

namespace mote {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

enum class Kind { Particles, Picture, Scene };

/// By the first bytes; by the name only where those say nothing, so that a damaged file gets its own reader's message.
Kind kindOf(const std::string& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) throw InputError(path, "", "a file", "no such file", nearestNames(path, path));
  if (fs::is_directory(path, ignored)) throw InputError(path, "", "a file", "a folder");
  std::ifstream file(path, std::ios::binary);
  char start[8] = {};
  file.read(start, sizeof start);
  if (!file.is_open()) throw InputError(path, "", "a file that can be read", "no permission to");
  constexpr char kExrMagic[] = {'\x76', '\x2f', '\x31', '\x01'};
  if (isParticleFile(path)) return Kind::Particles;
  if (std::memcmp(start, kExrMagic, sizeof kExrMagic) == 0) return Kind::Picture;
  const fs::path extension = fs::path(path).extension();
  for (const char* name : {".prt", ".npy", ".npz", ".ply", ".csv", ".geo", ".bgeo", ".vtk", ".vtu", ".vtp", ".hdf5",
                           ".h5", ".vdb", ".nvdb"})
    if (extension == name) return Kind::Particles;
  if (extension == ".exr") return Kind::Picture;
  if (extension == ".json") return Kind::Scene;
  throw InputError(path, "",
                   fmt::format("a particle file ({}), an OpenEXR picture or a scene (.json)", particleFormats()),
                   "none of these", "of a scene's other inputs mote info says nothing");
}

void describe(const std::string& path, bool json, bool measured, const CommonOptions& common) {
  const Kind kind = kindOf(path);
  const Json found = kind == Kind::Particles ? describeParticles(path)
                     : kind == Kind::Picture ? describePicture(path)
                                             : preflight(readScene(path), common, measured);
  if (json)  // one line a file: what jq and every line-wise reader takes
    fmt::print("{}\n", found.dump(-1, ' ', false, Json::error_handler_t::replace));
  else
    kind == Kind::Particles ? printParticles(found) : kind == Kind::Picture ? printPicture(found) : printPreflight(found);
  if (kind != Kind::Scene) return;
  std::fflush(stdout);
  requireNothingMissing(found);
}

/// All files, though some may be wrong: who has a hundred frames wants to know which.
void info(const std::vector<std::string>& files, bool json, bool measured, const CommonOptions& common) {
  if (files.size() == 1) return describe(files[0], json, measured, common);
  std::size_t wrong = 0;
  for (const std::string& path : files) {
    try {
      describe(path, json, measured, common);
    } catch (const InputError& error) {
      ++wrong;
      std::fflush(stdout);
      logError(error.what(), kBadInput);
    }
  }
  if (wrong > 0) throw InputError(fmt::format("{} of {} files are not what they should be", wrong, files.size()));
}

}  // namespace

Json describePicture(const std::string& path) {
  const Image image = readExr(path);
  std::size_t notFinite = 0;
  for (const vec4& p : image.pixels) notFinite += !std::isfinite(p.r + p.g + p.b + p.a);
  Json channels = Json::array(), attributes = Json::object();
  for (const ExrChannel& channel : exrChannels(path))
    channels.push_back({{"name", channel.name}, {"type", channel.type}});
  for (const auto& [name, value] : exrStrings(path)) attributes[name] = value;
  return {{"file", path},         {"kind", "picture"},       {"width", image.width},    {"height", image.height},
          {"channels", channels}, {"not_finite", notFinite}, {"attributes", attributes}};
}

void printPicture(const Json& info) {
  fmt::print("{}: OpenEXR, {} × {} pixels\n", info["file"].get<std::string>(), info["width"].get<int>(),
             info["height"].get<int>());
  fmt::print("  channels    ");
  for (const Json& channel : info["channels"])
    fmt::print(" {} ({})", channel["name"].get<std::string>(), channel["type"].get<std::string>());
  fmt::print("\n  not finite   {} pixels\n", info["not_finite"].get<std::size_t>());
  constexpr std::size_t kShown = 200;  // Mote's own statistics are longer; --json gives all of them
  for (const auto& [name, value] : info["attributes"].items()) {
    const auto text = value.get<std::string>();
    fmt::print("  {:<12} {}{}\n", name, text.substr(0, kShown),
               text.size() > kShown ? fmt::format("… ({} bytes; --json shows all)", text.size()) : "");
  }
}

std::string bytesText(double bytes) {
  if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
  if (bytes < 1e6) return fmt::format("{:.1f} kB", bytes / 1e3);
  if (bytes < 1e9) return fmt::format("{:.1f} MB", bytes / 1e6);
  return fmt::format("{:.2f} GB", bytes / 1e9);
}

void addInfoCommand(CLI::App& app, const CommonOptions& common, int&) {
  struct InfoOptions {
    std::vector<std::string> files;
    bool json = false, noMeasure = false;
  };
  auto options = std::make_shared<InfoOptions>();
  CLI::App* command = app.add_subcommand("info", "Say what particle files, pictures and scenes hold");
  command->add_option("files", options->files, "Particle files of any format, OpenEXR pictures, scenes (.json)")
      ->required()
      ->type_name("FILE");
  command->add_flag("--json", options->json, "Print one JSON object a file, each on a line of its own");
  command->add_flag("--no-measure", options->noMeasure,
                    "Of scenes only what headers tell: nothing is loaded, no time estimated, nothing looked for that is "
                    "suspicious");
  command->callback([options, &common] { info(options->files, options->json, !options->noMeasure, common); });
}

}  // namespace mote
