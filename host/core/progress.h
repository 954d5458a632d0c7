// How far a stage is: a bar on a terminal, an event a second with `--log json`, nothing elsewhere nor with -q.
#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace mote {

/// The stage at work, shown from its construction to its end, redrawn ten times a second by a thread of its own, and
/// with `--log json` an event `stage` at its end. There is one at a time: those made while another lives show nothing.
/// `advance` and `expect` are safe from any thread and cost an atomic addition.
class Progress {
 public:
  /// A stage that is not counted: its name and the time so far.
  explicit Progress(std::string stage);
  /// `total` in `unit`s ("rays"): also share, rate and remaining time.
  Progress(std::string stage, double total, std::string unit);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(double done);
  /// There is so much more to do than was said.
  void expect(double more);

 private:
  struct State;
  std::unique_ptr<State> state_;  // null where nothing is shown
};

/// The frames of a run, shown beside their stages: which of how many, and when the last will be done, as far as frames
/// that were written tell. Made, used and destroyed by one thread; one at a time.
class BatchProgress {
 public:
  explicit BatchProgress(std::size_t frames);
  ~BatchProgress();
  BatchProgress(const BatchProgress&) = delete;
  BatchProgress& operator=(const BatchProgress&) = delete;

  /// Frame `number` begins (event `frame_begin`) …
  void begin(int number);
  /// … and ends. One that failed says nothing about the time that others take.
  void end(bool written);
};

/// "850", "1.23 k", "45.6 M": three digits.
std::string shortCount(double count);
/// "4.2 s", "3:05 min", "1:02:03 h".
std::string shortSeconds(double seconds);

}  // namespace mote
