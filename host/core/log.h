// Messages: all of them go to stderr, so that stdout stays a program's answer. With `--log json` each is an event
// (log_event.h) instead of a line.
#pragma once
#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

namespace mote {

enum class Verbosity { Quiet, Normal, Verbose };

/// Process-wide; set once by `main`. Quiet keeps warnings out of stderr but still records them.
void setVerbosity(Verbosity verbosity);
Verbosity verbosity();

/// What a user wants to know at the default verbosity: one line.
void logInfo(const std::string& line);
/// What only `-v` shows.
void logVerbose(const std::string& line);
/// A warning: printed once however often it is raised, and kept for `--stats`. Safe from any thread.
void logWarning(const std::string& line);

/// What ends the command, or a part of it: "mote: …", with -q too; `exitCode` is what it comes to.
void logError(const std::string& message, int exitCode);

/// The warnings raised since the last call, in order; clears the list (also of what counts as printed).
std::vector<std::string> takeWarnings();

/// While it lives, warnings of the thread that made it go into its list, unprinted, instead of into the process'. Hand
/// them to logWarning where they belong.
class WarningsKept {
 public:
  explicit WarningsKept(std::vector<std::string>& into);
  ~WarningsKept();
  WarningsKept(const WarningsKept&) = delete;
  WarningsKept& operator=(const WarningsKept&) = delete;

 private:
  std::vector<std::string>* before_;
};

}  // namespace mote
