// mote: one program, one file a subcommand. The only place that catches exceptions and makes exit codes of them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <optional>
#include <string_view>

#include "host/core/error.h"
#include "host/core/error_line.h"
#include "host/core/foreign_lines.h"
#include "host/core/log.h"
#include "host/core/log_event.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"
#include "host/core/simd_targets.h"
#include "host/core/timer.h"
#include "host/scene/json_reader.h"
#include "tools/command.h"

namespace mote {
namespace {

// More than any machine has; a typo of a few digits would otherwise start as many threads.
constexpr int kMaxThreads = 4096;

/// The flags of SCENE.md's "common" line; they stand before or after the subcommand.
void addCommonOptions(CLI::App& app, CommonOptions& common) {
  app.add_option("--threads", common.threads, "Threads to use; 0: one a core")
      ->type_name("N")
      ->check(CLI::Range(0, kMaxThreads).description(""));
  app.add_option("--device", common.device, "Vulkan device, by its number or a part of its name (see mote devices)")
      ->type_name("N|NAME");
  app.add_option("--device-memory", common.deviceMemory,
                 "Memory of the device that may be held: bytes, 512M, 1.5G or 80% (default 90%); what does not fit is "
                 "worked on in parts")
      ->type_name("SIZE");
  app.add_flag("--validate", common.validate,
               "Turn the Vulkan validation layers on; any message of theirs is a failure");
  app.add_option("--log", common.log, "What stderr is in: text, or json, one event a line (docs/log.md)")
      ->type_name("text|json")
      ->check(CLI::IsMember({"text", "json"}).description(""));
  CLI::Option* quiet = app.add_flag("-q,--quiet", common.quiet, "Print nothing but errors to stderr");
  app.add_flag("-v,--verbose", common.verbose, "Print more to stderr")->excludes(quiet);
}

void addCommands(CLI::App& app, const CommonOptions& common, int& exitCode) {
  addRenderCommand(app, common, exitCode);
  addLightCommand(app, common, exitCode);
  addCrosscheckCommand(app, common, exitCode);
  addGenerateCommand(app, common, exitCode);
  addConvertCommand(app, common, exitCode);
  addRepairCommand(app, common, exitCode);
  addFarmCommand(app, common, exitCode);
  addInfoCommand(app, common, exitCode);
  addCompareCommand(app, common, exitCode);
  addBenchCommand(app, common, exitCode);
  addDevicesCommand(app, common, exitCode);
}

/// The subcommand in use, innermost, or the app itself.
const CLI::App* usedCommand(const CLI::App* app) {
  while (!app->get_subcommands().empty()) app = app->get_subcommands().front();
  return app;
}

/// "mote bench sort"
std::string fullName(const CLI::App* command) {
  const CLI::App* parent = command->get_parent();
  return parent ? fullName(parent) + " " + command->get_name() : command->get_name();
}

/// One sentence more than CLI11 says where the subcommand is missing or misspelt; "" elsewhere.
std::string aboutCommands(const CLI::App& app) {
  if (!app.get_subcommands().empty()) return "";
  std::vector<std::string_view> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  const std::vector<std::string> left = app.remaining();
  if (left.empty()) return "";
  const auto word =
      std::find_if(left.begin(), left.end(), [](const std::string& text) { return !text.starts_with('-'); });
  if (word == left.end()) return fmt::format("\"{}\" is no flag of mote, and a command is missing", left.front());
  return fmt::format("\"{}\" is no command of mote; the nearest is \"{}\"", *word, nearestWord(*word, names));
}

int reportUsage(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = usedCommand(&app);
  const std::string about = aboutCommands(app);
  logError(
      fmt::format("{}\nRun '{} --help' for what it takes.", about.empty() ? error.what() : about, fullName(command)),
      kBadInput);
  return kBadInput;
}

int report(const std::string& message, int exitCode) {
  logError(message, exitCode);
  return exitCode;
}

/// What `--log` asks for, before anything else is read: wrong usage too is told that way.
LogFormat logFormatOf(int argc, char** argv) {
  LogFormat format = LogFormat::Text;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument(argv[i]);
    if (argument == "--") break;
    const bool json =
        argument == "--log=json" || (argument == "--log" && i + 1 < argc && std::string_view(argv[i + 1]) == "json");
    if (json) format = LogFormat::Json;
  }
  return format;
}

void logStart(const CLI::App& app, const CommonOptions& common) {
  logEvent("start", {{"version", MOTE_VERSION},
                     {"command", fullName(usedCommand(&app))},
                     {"threads", threadCount()},
                     {"device", common.device.empty() ? "auto" : common.device}});
}
void logEnd(int exitCode, const Timer& sinceStart) {
  logEvent("end", {{"exit_code", exitCode}, {"seconds", sinceStart.seconds()}});
}

int run(int argc, char** argv, std::atomic<bool>& started) {
  CommonOptions common;
  int exitCode = 0;
  CLI::App app("Renders particle data sets as participating media.", "mote");
  app.set_version_flag("--version", "mote " MOTE_VERSION);
  app.set_help_flag("-h,--help", "Print this help");
  app.require_subcommand(1);
  app.fallthrough();  // the subcommands, made after it, inherit it: common flags may follow them
  app.footer(
      "Any command also takes --threads, --device, --device-memory, --validate, --log, -q and -v (mote --help).\n"
      "Exit codes: 0 done, 1 a comparison failed, 2 bad input or usage, 3 the machine (device, memory, disk), "
      "130 interrupted, 143 ended.");
  addCommonOptions(app, common);
  addCommands(app, common, exitCode);

  if (argc <= 1) {
    fmt::print(stderr, "{}", app.help());
    return kBadInput;
  }
  std::optional<ThreadLimit> threads;
  app.parse_complete_callback([&] {  // runs before the subcommand's own callback
    setVerbosity(common.quiet ? Verbosity::Quiet : common.verbose ? Verbosity::Verbose : Verbosity::Normal);
    if (const char* simd = std::getenv("MOTE_SIMD"); simd && *simd) limitSimdTargets("MOTE_SIMD", simd);
    threads.emplace(common.threads);
    started = true;
    logStart(app, common);
  });
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& wanted) {  // --help or --version
    app.exit(wanted);
  } catch (const CLI::ParseError& error) {
    return reportUsage(app, error);
  }
  return exitCode;
}

}  // namespace
}  // namespace mote

int main(int argc, char** argv) {
  using namespace mote;
  int exitCode = 0;
  static const Timer sinceStart;  // static: a signal may come while the process ends
  static std::atomic<bool> started{false};
  std::optional<ForeignLines> foreign;
  setLogFormat(logFormatOf(argc, argv));
  try {
    std::signal(SIGXFSZ, SIG_IGN);  // a file-size limit is a failed write with a message, not a killed process
    removeTemporaryFilesOnSignal([](int code) {
      wipeBar();
      if (started) logEnd(code, sinceStart);
    });
    if (logFormat() == LogFormat::Json) foreign.emplace();
    exitCode = run(argc, argv, started);
    if (std::fflush(stdout) != 0) exitCode = report("writing to stdout failed", kMachine);
  } catch (const InputError& error) {
    exitCode = report(error.what(), kBadInput);
  } catch (const MachineError& error) {
    exitCode = report(error.what(), kMachine);
  } catch (const std::bad_alloc&) {
    exitCode = report("memory ran out; fewer particles or a smaller picture need less (mote info SCENE says how much)",
                      kMachine);
  } catch (const std::exception& error) {
    exitCode = report(fmt::format("internal error, a bug in mote: {}", error.what()), kMachine);
  }
  foreign.reset();
  if (started) logEnd(exitCode, sinceStart);
  return exitCode;
}
