#include "host/core/log.h"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "host/core/log_event.h"

namespace mote {
namespace {

std::atomic<Verbosity> currentVerbosity{Verbosity::Normal};
std::mutex warningMutex;
std::vector<std::string> warnings;
thread_local std::vector<std::string>* keptWarnings = nullptr;

}  // namespace

void setVerbosity(Verbosity verbosity) { currentVerbosity = verbosity; }
Verbosity verbosity() { return currentVerbosity; }

void logInfo(const std::string& line) { logEvent("info", {{"message", line}}, line); }

void logVerbose(const std::string& line) {
  if (verbosity() == Verbosity::Verbose) logInfo(line);
}

void logWarning(const std::string& line) {
  if (keptWarnings) {
    keptWarnings->push_back(line);
    return;
  }
  const std::scoped_lock lock(warningMutex);
  if (std::find(warnings.begin(), warnings.end(), line) != warnings.end()) return;
  warnings.push_back(line);
  logEvent("warning", {{"message", line}}, "warning: " + line);
}

void logError(const std::string& message, int exitCode) {
  logFailure("error", {{"message", message}, {"exit_code", exitCode}}, "mote: " + message);
}

std::vector<std::string> takeWarnings() {
  const std::scoped_lock lock(warningMutex);
  return std::exchange(warnings, {});
}

WarningsKept::WarningsKept(std::vector<std::string>& into) : before_(std::exchange(keptWarnings, &into)) {}
WarningsKept::~WarningsKept() { keptWarnings = before_; }

}  // namespace mote
