// What others write to stderr, with `--log json`.
#pragma once
#include <atomic>
#include <thread>

namespace mote {

/// While it lives, each line that drivers, layers and libraries write to stderr by themselves becomes an event `info`
/// with the field `source` "stderr", so that every line is an event. One at a time; what is still on its way when the
/// process aborts is lost. Does nothing where the system lends no pipe.
class ForeignLines {
 public:
  ForeignLines();
  ~ForeignLines();
  ForeignLines(const ForeignLines&) = delete;
  ForeignLines& operator=(const ForeignLines&) = delete;

 private:
  void read();

  int stderr_ = -1, pipe_ = -1;  // what stderr was; where its lines arrive
  std::atomic<bool> ending_{false};
  std::thread reader_;
};

}  // namespace mote
