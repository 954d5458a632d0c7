// Messages for people: all of them go to stderr, so that stdout stays a program's answer.
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

/// A bar on a terminal, nothing elsewhere. Safe from any thread; `done` counts in the unit of `total`.
class Progress {
 public:
  Progress(std::string stage, double total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void advance(double done);

 private:
  struct State;
  State* state_;  // null where no bar is drawn
};

}  // namespace mote
