// What every subcommand of `mote` shares: one file each, registered by name in main.cpp.
#pragma once
#include <string>

namespace CLI {
class App;
}

namespace mote {

// SCENE.md: 0 done, 1 a comparison failed, 2 bad input or usage, 3 the machine; output_file.h: 130 interrupted.
constexpr int kBadInput = 2, kMachine = 3;

/// The flags that stand before or after any subcommand.
struct CommonOptions {
  unsigned threads = 0;      ///< 0: one a core
  std::string device;        ///< Vulkan device by number or part of its name; empty: the best
  std::string deviceMemory;  ///< how much of its memory may be held; empty: MemoryLimit's default
  bool validate = false;     ///< validation and synchronization layers on; any message makes the command fail with 3
  std::string log = "text";  ///< "text" or "json": what stderr is in
  bool quiet = false, verbose = false;
};

/// An environment variable that tests set (docs/architecture.md, "Faults"); "" where it is not.
std::string testSetting(const char* name);

// Each adds its subcommand with its flags; the callback runs the command and throws as the library does. The int that a
// command reports through `exitCode` is 0, 1 where a comparison failed, or what the worst of several frames came to.
void addRenderCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addLightCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addCrosscheckCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addGenerateCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addConvertCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addRepairCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addFarmCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addInfoCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addCompareCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addBenchCommand(CLI::App& app, const CommonOptions& common, int& exitCode);
void addDevicesCommand(CLI::App& app, const CommonOptions& common, int& exitCode);

}  // namespace mote
