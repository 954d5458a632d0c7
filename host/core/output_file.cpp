#include "host/core/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <future>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>

#include "host/core/error.h"

namespace mote {
namespace fs = std::filesystem;
namespace {

/// Temporaries that exist now. Files are made, renamed and removed under the mutex, and whoever ends the process never
/// lets it go again: nothing can appear behind its back.
struct LivingTemporaries {
  std::mutex mutex;
  std::set<std::string> paths;
};

LivingTemporaries& livingTemporaries() {
  static auto* const living = new LivingTemporaries;  // never destroyed: a signal may come while the process ends
  return *living;
}

/// True where the path may well be meant, and the machine does not let it be written: a disk that is full or read-only,
/// a folder of somebody else's.
bool isMachines(int error) {
  constexpr std::array kMachines{EACCES, EPERM, EROFS, ENOSPC, EDQUOT, EIO, EMFILE, ENFILE, ENOMEM, ESTALE, ETIMEDOUT};
  return std::find(kMachines.begin(), kMachines.end(), error) != kMachines.end();
}

constexpr int kSignalled = 128;  // and the signal's number: what shells make of it
/// A terminal that was stopped, or a pipe that nobody reads, must not keep a process from ending.
constexpr std::chrono::milliseconds kLastCall{200};

/// Calls it on a thread of its own, and goes on without it where it takes longer.
void callWithin(std::chrono::milliseconds limit, const std::function<void()>& call) {
  std::promise<void> done;
  try {
    std::thread([&] {
      call();
      done.set_value();
    }).detach();
    done.get_future().wait_for(limit);
  } catch (const std::system_error&) {
    // No thread is left for it.
  }
}

/// Takes one signal of the set and ends the process.
[[noreturn]] void endOnSignal(sigset_t signals, const std::function<void(int exitCode)>& last) {
  int signal = 0;
  while (sigwait(&signals, &signal) != 0) {
  }
  LivingTemporaries& living = livingTemporaries();
  living.mutex.lock();
  for (const std::string& path : living.paths) ::unlink(path.c_str());
  if (last) callWithin(kLastCall, [&last, code = kSignalled + signal] { last(code); });
  ::_exit(kSignalled + signal);  // no destructors: other threads are in the middle of their work
}

}  // namespace

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
  const fs::path target(path_);
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::error_code ignored;
  if (path_.empty() || !target.has_filename()) throw InputError(fmt::format("output '{}' names no file", path_));
  if (!fs::exists(folder, ignored))
    throw InputError(fmt::format("{}: the folder '{}' does not exist; create it first", path_, folder.string()));
  if (!fs::is_directory(folder, ignored))
    throw InputError(fmt::format("{}: '{}' is not a folder", path_, folder.string()));
  if (fs::is_directory(target, ignored)) throw InputError(fmt::format("{}: is a folder, not a file", path_));

  static std::atomic<unsigned> counter{0};
  temporary_ = (folder / fmt::format(".{}.{}-{}.part{}", target.stem().string(), ::getpid(), counter++,
                                     target.extension().string()))
                   .string();
  // Created here, so that a folder without write permission is reported before any work is done.
  LivingTemporaries& living = livingTemporaries();
  const std::scoped_lock lock(living.mutex);
  const auto listed = living.paths.insert(temporary_).first;
  const int handle = ::open(temporary_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0666);
  if (handle < 0) {
    const int why = errno;
    living.paths.erase(listed);
    const std::string message = fmt::format("{}: cannot write there: {}", path_, std::strerror(why));
    if (isMachines(why)) throw MachineError(message);
    throw InputError(message);
  }
  ::close(handle);
}

OutputFile::~OutputFile() {
  if (committed_) return;
  LivingTemporaries& living = livingTemporaries();
  const std::scoped_lock lock(living.mutex);
  ::unlink(temporary_.c_str());
  living.paths.erase(temporary_);
}

void OutputFile::commit() {
  const int handle = ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0)
    throw MachineError(fmt::format("{}: cannot reopen what was written: {}", path_, std::strerror(errno)));
  const int synced = ::fsync(handle);
  const int why = errno;
  struct stat written {};
  ::fstat(handle, &written);
  ::close(handle);
  // Pipes and some network disks cannot sync; that is no lost data.
  if (synced != 0 && why != EINVAL && why != EROFS)
    throw MachineError(fmt::format("{}: writing {} bytes failed: {}", path_, written.st_size, std::strerror(why)));
  LivingTemporaries& living = livingTemporaries();
  const std::scoped_lock lock(living.mutex);
  if (::rename(temporary_.c_str(), path_.c_str()) != 0)
    throw MachineError(fmt::format("{}: cannot rename '{}' to it: {}", path_, temporary_, std::strerror(errno)));
  living.paths.erase(temporary_);
  committed_ = true;
}

void writeWholeFile(const std::string& path, const std::string& bytes) {
  OutputFile file(path);
  std::FILE* stream = std::fopen(file.temporaryPath().c_str(), "wb");
  if (!stream) throw MachineError(fmt::format("{}: cannot open: {}", path, std::strerror(errno)));
  int error = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream) != bytes.size()) error = errno;
  if (std::fclose(stream) != 0 && error == 0) error = errno;
  if (error != 0)
    throw MachineError(fmt::format("{}: writing {} bytes failed: {}", path, bytes.size(), std::strerror(error)));
  file.commit();
}

void removeTemporaryFilesOnSignal(std::function<void(int exitCode)> last) {
  // sigwait on a thread of its own, and not a handler: removing files needs locks, which handlers must not take.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) == 0 && action.sa_handler != SIG_IGN) sigaddset(&signals, signal);
  }
  livingTemporaries();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    std::thread(endOnSignal, signals, std::move(last)).detach();
  } catch (const std::system_error& e) {
    throw MachineError(fmt::format("cannot start the thread that waits for signals: {}", e.what()));
  }
}

}  // namespace mote
