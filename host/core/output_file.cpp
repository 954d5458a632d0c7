#include "host/core/output_file.h"

#include <fcntl.h>
#include <sys/file.h>
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
#include <ctime>
#include <filesystem>
#include <future>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <thread>

#include "host/core/error.h"
#include "host/core/sha256.h"

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

constexpr std::string_view kPart = ".part";

/// Eight digits that tell this machine's temporaries from those of others that share the folder.
const std::string& hostMark() {
  static const std::string mark = [] {
    char name[256] = "";
    ::gethostname(name, sizeof name - 1);
    return sha256OfText(name).substr(0, 8);
  }();
  return mark;
}

/// What a temporary's name says.
struct Temporary {
  std::string target, host;
};

/// Of ".STEM.PID-N-HOST.part.EXTENSION"; none where the name is of another form.
std::optional<Temporary> parseTemporary(const std::string& name) {
  const std::size_t part = name.rfind(kPart);
  if (part == std::string::npos || name[0] != '.') return {};
  const std::string extension = name.substr(part + kPart.size());
  const std::size_t dot = name.rfind('.', part - 1);
  if (dot == std::string::npos || dot == 0 || (!extension.empty() && extension.rfind('.') != 0)) return {};
  const std::string mark = name.substr(dot + 1, part - dot - 1);
  const std::size_t last = mark.rfind('-');
  const auto is = [](std::string_view text, const char* characters, std::size_t least) {
    return text.size() >= least && text.find_first_not_of(characters) == std::string_view::npos;
  };
  if (last == std::string::npos || mark.size() != last + 9 || !is(mark.substr(last + 1), "0123456789abcdef", 8) ||
      !is(mark.substr(0, last), "0123456789-", 3))
    return {};
  return Temporary{name.substr(1, dot - 1) + extension, mark.substr(last + 1)};
}

constexpr std::time_t kForeignAge = 24 * 60 * 60;  // [s]; no file is written for so long without a byte

/// The kernel lets go of a writer's lock when the writer dies, and not before. Locks may be of one machine alone,
/// though (NFS with local_lock): what another machine's processes left must also be old.
bool removeIfStale(const fs::path& path, const Temporary& temporary) {
  const int handle = ::open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (handle < 0) return false;
  struct stat found {};
  const bool stale = ::fstat(handle, &found) == 0 && S_ISREG(found.st_mode) &&
                     (temporary.host == hostMark() || std::time(nullptr) - found.st_mtime > kForeignAge) &&
                     ::flock(handle, LOCK_EX | LOCK_NB) == 0;
  const bool removed = stale && ::unlink(path.c_str()) == 0;
  ::close(handle);
  return removed;
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
  while (!create(fs::path(folder) / fmt::format(".{}.{}-{}-{}{}{}", target.stem().string(), ::getpid(), counter++,
                                                hostMark(), kPart, target.extension().string()))) {
  }
}

/// Created by the constructor, so that a folder without write permission is reported before any work is done. False
/// where the name is taken: by a file of a dead process of the same number, or by whoever took this one for such.
bool OutputFile::create(const std::string& temporary) {
  LivingTemporaries& living = livingTemporaries();
  const std::scoped_lock lock(living.mutex);
  const auto listed = living.paths.insert(temporary).first;
  lock_ = ::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
  if (lock_ < 0) {
    const int why = errno;
    living.paths.erase(listed);
    if (why == EEXIST) return false;
    const std::string message = fmt::format("{}: cannot write there: {}", path_, std::strerror(why));
    if (isMachines(why)) throw MachineError(message);
    throw InputError(message);
  }
  // Where the file system has no locks, removeStaleTemporaries gets none either and leaves the file alone.
  struct stat made {};
  const bool taken = ::flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (taken || (::fstat(lock_, &made) == 0 && made.st_nlink == 0)) {
    ::unlink(temporary.c_str());
    ::close(lock_);
    living.paths.erase(listed);
    return false;
  }
  temporary_ = temporary;
  return true;
}

OutputFile::~OutputFile() {
  if (committed_) return;
  LivingTemporaries& living = livingTemporaries();
  const std::scoped_lock lock(living.mutex);
  ::unlink(temporary_.c_str());
  living.paths.erase(temporary_);
  ::close(lock_);
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
  ::close(lock_);
  committed_ = true;
}

std::size_t removeStaleTemporaries(const std::string& folder,
                                   const std::function<bool(const std::string& name)>& ours) {
  std::size_t removed = 0;
  std::error_code none;  // a folder that cannot be listed has nothing that could be removed
  for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none)) {
    const std::string name = entry->path().filename().string();
    const std::optional<Temporary> temporary = parseTemporary(name);
    if (temporary && ours(temporary->target) && removeIfStale(entry->path(), *temporary)) ++removed;
  }
  return removed;
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
