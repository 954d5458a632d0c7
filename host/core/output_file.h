// An output file appears whole or not at all: written beside its place, then renamed.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

namespace mote {

/// Usage: OutputFile file("a.exr"); write to file.temporaryPath(); file.commit(). Without commit (an exception, say)
/// the temporary is removed and whatever stood at the path before stays.
class OutputFile {
 public:
  /// Throws InputError when the folder is missing or not a folder, the path is a folder or no name for a file, and
  /// MachineError when it cannot be written: a folder or disk that is read-only or full.
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Same folder, name starting with '.', ending in the same extension, unique to this process and object; locked
  /// (flock) as long as it exists.
  const std::string& temporaryPath() const { return temporary_; }
  const std::string& path() const { return path_; }

  /// Flushes to disk and renames. Throws MachineError when the disk refuses.
  void commit();

 private:
  bool create(const std::string& temporary);
  std::string path_, temporary_;
  int lock_ = -1;
  bool committed_ = false;
};

/// Removes what killed processes left in a folder of the files whose names are `ours`: temporaries that nobody has
/// locked and that this machine made, or another and not within a day. Returns how many.
std::size_t removeStaleTemporaries(const std::string& folder, const std::function<bool(const std::string& name)>& ours);

/// Writes `bytes` through an OutputFile; throws as it does, and MachineError ("disk full", with the byte count).
void writeWholeFile(const std::string& path, const std::string& bytes);

/// From now on SIGINT, SIGTERM and SIGHUP remove the temporaries of every living OutputFile and end the process with
/// 128 + the signal, as shells have it (130, 143, 129); what was committed before stays. `last` is called just before
/// the end with that exit code, on a thread of its own while others work on. Signals that the process was started to
/// ignore (nohup) stay ignored. Call once, before any other thread starts: all threads must inherit the blocked
/// signals. Throws MachineError where no thread can be started.
void removeTemporaryFilesOnSignal(std::function<void(int exitCode)> last = {});

}  // namespace mote
