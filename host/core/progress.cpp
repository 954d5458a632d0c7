#include "host/core/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <stop_token>
#include <system_error>
#include <thread>

#include "host/core/error_line.h"
#include "host/core/log.h"
#include "host/core/log_event.h"
#include "host/core/timer.h"

namespace mote {
namespace {

constexpr std::chrono::milliseconds kRedraw{100}, kEventEvery{1000}, kEventLook{250};
constexpr int kShortestBar = 5, kLongestBar = 30;
constexpr std::size_t kFrame = 3;  // a blank and two brackets

/// What BatchProgress knows; guarded by `mutex`.
struct Batch {
  std::size_t frames = 0, index = 0;  ///< of which the index-th is at work, from 1
  double secondsDone = 0;             ///< of the frames that were written …
  std::size_t written = 0;            ///< … and how many they are
  Timer frame;                        ///< since the one at work began

  std::optional<double> remaining() const {
    if (written == 0 || frames < 2) return std::nullopt;
    const double mean = secondsDone / static_cast<double>(written);
    return std::max(mean - frame.seconds(), 0.0) + mean * static_cast<double>(frames - index);
  }
};

struct Shared {
  std::mutex mutex;
  Batch batch;
  std::chrono::steady_clock::time_point lastEvent{};  ///< of all stages: one a second, however short they are
  std::atomic<bool> busy{false};                      ///< a stage is shown
};
Shared& shared() {
  static auto* const all = new Shared;  // never destroyed: threads may outlive main's statics
  return *all;
}

}  // namespace

struct Progress::State {
  State(std::string name, double all, std::string each)
      : stage(std::move(name)), unit(std::move(each)), total(all), json(logFormat() == LogFormat::Json) {
    try {
      thread = std::jthread([this](const std::stop_token& stop) { show(stop); });
    } catch (const std::system_error&) {
      // A machine without another thread does the work all the same.
    }
  }

  void show(const std::stop_token& stop) {
    std::unique_lock lock(mutex);
    while (!wake.wait_for(lock, stop, json ? kEventLook : kRedraw, [&] { return stop.stop_requested(); }))
      if (json)
        writeEvent();
      else
        drawBar(bar());
  }

  double share() const { return total > 0 ? std::clamp(done / total, 0.0, 1.0) : 0; }
  double rate() const { return done / std::max(timer.seconds(), 1e-9); }
  double remaining() const { return share() > 0 ? timer.seconds() * (1 - share()) / share() : NAN; }

  /// As long as the terminal is wide: the bar itself takes what the words leave.
  std::string bar() const {
    const std::scoped_lock lock(shared().mutex);
    const Batch& batch = shared().batch;
    std::string before, after;
    if (batch.frames > 1 && batch.index > 0) before = fmt::format("frame {}/{}  ", batch.index, batch.frames);
    before += stage;
    if (total > 0) after = fmt::format("  {:.0f} %  {} {}/s", std::floor(share() * 100), shortCount(rate()), unit);
    if (total > 0 && share() > 0)
      after += fmt::format("  {} left", shortSeconds(remaining()));
    else
      after += "  " + shortSeconds(timer.seconds());
    if (const std::optional<double> left = batch.remaining(); left && batch.index > 0)
      after += fmt::format("  all {} left", shortSeconds(*left));
    const int room = static_cast<int>(barColumns()) - static_cast<int>(before.size() + after.size() + kFrame);
    if (total <= 0 || room < kShortestBar) return before + after;
    const int width = std::min(room, kLongestBar), filled = static_cast<int>(share() * width);
    return fmt::format("{} [{:#<{}}{:.<{}}]{}", before, "", filled, "", width - filled, after);
  }

  void writeEvent() const {
    LogFields fields{{"stage", stage}, {"seconds", timer.seconds()}};
    {
      const std::scoped_lock lock(shared().mutex);
      const auto now = std::chrono::steady_clock::now();
      if (now - shared().lastEvent < kEventEvery) return;
      shared().lastEvent = now;
      if (total > 0) {
        fields.insert(fields.end(), {{"done", std::llround(std::min<double>(done, total))},
                                     {"total", std::llround(total)},
                                     {"unit", unit},
                                     {"rate", rate()},
                                     {"remaining_seconds", remaining()}});
      }
      const Batch& batch = shared().batch;
      if (batch.frames > 1 && batch.index > 0)
        fields.insert(fields.end(), {{"index", batch.index},
                                     {"frames", batch.frames},
                                     {"batch_remaining_seconds", batch.remaining().value_or(NAN)}});
    }
    logEvent("progress", fields);
  }

  const std::string stage, unit;
  std::atomic<double> done{0}, total;
  const bool json;
  const int exceptions = std::uncaught_exceptions();
  const Timer timer;
  std::mutex mutex;  // of the waiting thread alone
  std::condition_variable_any wake;
  std::jthread thread;  // last: it uses all of the above
};

Progress::Progress(std::string stage) : Progress(std::move(stage), 0, "") {}

Progress::Progress(std::string stage, double total, std::string unit) {
  if (verbosity() == Verbosity::Quiet || !(logFormat() == LogFormat::Json || barsAreDrawn())) return;
  if (shared().busy.exchange(true)) return;
  state_ = std::make_unique<State>(std::move(stage), total, std::move(unit));
}

Progress::~Progress() {
  if (!state_) return;
  if (state_->thread.joinable()) {
    state_->thread.request_stop();
    state_->thread.join();
  }
  wipeBar();
  if (std::uncaught_exceptions() == state_->exceptions)  // else it failed, and whoever catches says why
    logEvent("stage", {{"stage", state_->stage}, {"seconds", state_->timer.seconds()}});
  shared().busy = false;
}

void Progress::advance(double done) {
  if (state_) state_->done.fetch_add(done, std::memory_order_relaxed);
}

void Progress::expect(double more) {
  if (state_) state_->total.fetch_add(more, std::memory_order_relaxed);
}

BatchProgress::BatchProgress(std::size_t frames) {
  const std::scoped_lock lock(shared().mutex);
  shared().batch = {};
  shared().batch.frames = frames;
}

BatchProgress::~BatchProgress() {
  const std::scoped_lock lock(shared().mutex);
  shared().batch = {};
  setEventFrame(std::nullopt);
}

void BatchProgress::begin(int number) {
  std::size_t index = 0, frames = 0;
  {
    const std::scoped_lock lock(shared().mutex);
    Batch& batch = shared().batch;
    index = ++batch.index, frames = batch.frames;
    batch.frame = {};
  }
  setEventFrame(number);
  logEvent("frame_begin", {{"index", index}, {"frames", frames}});
}

void BatchProgress::end(bool written) {
  {
    const std::scoped_lock lock(shared().mutex);
    Batch& batch = shared().batch;
    if (written) batch.secondsDone += batch.frame.seconds(), ++batch.written;
  }
  setEventFrame(std::nullopt);
}

std::string shortCount(double count) {
  constexpr std::array<const char*, 5> kPrefixes{"", " k", " M", " G", " T"};
  std::size_t prefix = 0;
  // 999.5 would be rounded to 1e+03.
  for (; count >= 999.5 && prefix + 1 < kPrefixes.size(); ++prefix) count /= 1000;
  return fmt::format("{:.3g}{}", count, kPrefixes[prefix]);
}

std::string shortSeconds(double seconds) {
  if (seconds < 59.95) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<long long>(std::min(seconds, 1e15) + 0.5);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace mote
