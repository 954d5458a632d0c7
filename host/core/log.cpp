#include "host/core/log.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <mutex>

namespace mote {
namespace {

std::atomic<Verbosity> currentVerbosity{Verbosity::Normal};
std::mutex warningMutex;
std::vector<std::string> warnings;
thread_local std::vector<std::string>* keptWarnings = nullptr;

}  // namespace

void setVerbosity(Verbosity verbosity) { currentVerbosity = verbosity; }
Verbosity verbosity() { return currentVerbosity; }

void logInfo(const std::string& line) {
  if (verbosity() != Verbosity::Quiet) fmt::print(stderr, "{}\n", line);
}

void logVerbose(const std::string& line) {
  if (verbosity() == Verbosity::Verbose) fmt::print(stderr, "{}\n", line);
}

void logWarning(const std::string& line) {
  if (keptWarnings) {
    keptWarnings->push_back(line);
    return;
  }
  const std::scoped_lock lock(warningMutex);
  if (std::find(warnings.begin(), warnings.end(), line) != warnings.end()) return;
  warnings.push_back(line);
  if (verbosity() != Verbosity::Quiet) fmt::print(stderr, "warning: {}\n", line);
}

std::vector<std::string> takeWarnings() {
  const std::scoped_lock lock(warningMutex);
  return std::exchange(warnings, {});
}

WarningsKept::WarningsKept(std::vector<std::string>& into) : before_(std::exchange(keptWarnings, &into)) {}
WarningsKept::~WarningsKept() { keptWarnings = before_; }

struct Progress::State {
  using Clock = std::chrono::steady_clock;
  std::string stage;
  double total;
  std::mutex mutex;
  double done = 0;
  Clock::time_point start = Clock::now(), drawn = start;
};

Progress::Progress(std::string stage, double total) : state_(nullptr) {
  if (verbosity() == Verbosity::Quiet || !isatty(STDERR_FILENO) || total <= 0) return;
  state_ = new State{std::move(stage), total, {}, 0, State::Clock::now(), State::Clock::now()};
}

Progress::~Progress() {
  if (!state_) return;
  fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
  delete state_;
}

void Progress::advance(double done) {
  if (!state_) return;
  const std::scoped_lock lock(state_->mutex);
  state_->done += done;
  const auto now = State::Clock::now();
  if (now - state_->drawn < std::chrono::milliseconds(100)) return;  // a terminal needs no more than ten a second
  state_->drawn = now;
  const double share = std::min(1.0, state_->done / state_->total);
  const double seconds = std::chrono::duration<double>(now - state_->start).count();
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(share * kWidth);
  fmt::print(stderr, "\r\033[K{:<9} [{:#<{}}{:.<{}}] {:3.0f} %  {:.1f} s left", state_->stage, "", filled, "",
             kWidth - filled, share * 100, share > 0 ? seconds * (1 - share) / share : 0.0);
  std::fflush(stderr);
}

}  // namespace mote
