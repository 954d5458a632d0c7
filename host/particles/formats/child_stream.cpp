#include "host/particles/formats/child_stream.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <mutex>
#include <new>

#include "host/core/error.h"

namespace mote {
namespace {

enum class Kind : char { Data = 'D', Input = 'I', Machine = 'M', End = 'E' };

/// Far more than a message of ours has: chunks of at most 1 GiB, widened to doubles.
constexpr std::uint64_t kMostMessage = std::uint64_t{1} << 34;
constexpr std::size_t kPiece = 1 << 20;  ///< memory is taken as the bytes arrive
/// Its limit is on computing; this one is for a child that does not even do that.
constexpr int kSilenceMilliseconds = 10 * 60 * 1000;

void put(int to, const void* data, std::size_t bytes) {
  const char* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t done = ::write(to, from, bytes);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) ::_exit(2);  // nobody reads any more
    from += done, bytes -= static_cast<std::size_t>(done);
  }
}

void put(int to, Kind kind, const void* data, std::uint64_t bytes) {
  put(to, &kind, sizeof kind), put(to, &bytes, sizeof bytes), put(to, data, bytes);
}

/// In the child. It ends here, without what a whole program does at its end.
[[noreturn]] void run(int to, unsigned seconds, const std::function<void(const ChildStream::Send&)>& work) {
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
  const rlimit time{seconds, seconds + 5}, core{0, 0};  // at the first a signal that says why, then an end
  ::setrlimit(RLIMIT_CPU, &time), ::setrlimit(RLIMIT_CORE, &core);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPIPE, SIGXCPU, SIGINT, SIGTERM})
    ::signal(signal, SIG_DFL);
  const auto say = [&](Kind kind, const char* text) { put(to, kind, text, std::strlen(text)); };
  try {
    work([&](std::span<const std::byte> message) { put(to, Kind::Data, message.data(), message.size()); });
    say(Kind::End, "");
  } catch (const InputError& error) {
    say(Kind::Input, error.what());
  } catch (const std::bad_alloc&) {
    say(Kind::Machine, "not enough memory");
  } catch (const std::exception& error) {
    say(Kind::Machine, error.what());
  }
  ::_exit(0);
}

}  // namespace

ChildStream::ChildStream(std::string path, std::string library, unsigned seconds,
                         const std::function<void(const Send&)>& work)
    : path_(std::move(path)), library_(std::move(library)) {
  // One at a time, so that no other child keeps the writing end of this one's pipe.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw MachineError(fmt::format("{}: no pipe to {}: {}", path_, library_, std::strerror(errno)));
  ::fcntl(ends[1], F_SETPIPE_SZ, static_cast<int>(kPiece));  // the machine may allow less, which is only slower
  child_ = ::fork();
  if (child_ == 0) run(ends[1], seconds, work);
  const int error = errno;
  ::close(ends[1]);
  from_ = ends[0];
  if (child_ > 0) return;
  ::close(from_);
  throw MachineError(fmt::format("{}: no process for {}: {}", path_, library_, std::strerror(error)));
}

ChildStream::~ChildStream() {
  ::close(from_);
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);
  while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
}

bool ChildStream::receive(void* to, std::size_t bytes) {
  char* at = static_cast<char*>(to);
  while (bytes > 0) {
    pollfd ready{from_, POLLIN, 0};
    const int events = ::poll(&ready, 1, kSilenceMilliseconds);
    if (events == 0) throw MachineError(fmt::format("{}: {} does not answer", path_, library_));
    const ssize_t got = events < 0 ? -1 : ::read(from_, at, bytes);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got, bytes -= static_cast<std::size_t>(got);
  }
  return true;
}

void ChildStream::fail() {
  int status = 0;
  while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) continue;
  child_ = -1;
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGTERM || signal == SIGINT || signal == SIGKILL)  // somebody's, or the machine's for want of memory
    throw MachineError(fmt::format("{}: the process that reads it was ended: {}", path_, strsignal(signal)));
  throw InputError(path_, library_, "data that it can read",
                   signal == SIGXCPU ? "some over which it takes for ever" : "some that make it crash",
                   "the file is damaged");
}

bool ChildStream::next(std::vector<std::byte>& message) {
  Kind kind = Kind::End;
  std::uint64_t bytes = 0;
  if (!receive(&kind, sizeof kind) || !receive(&bytes, sizeof bytes) || bytes > kMostMessage) fail();
  message.clear();
  while (message.size() < bytes) {
    const std::size_t old = message.size();
    // Twice as much as there is: not each piece shall move what came before it.
    const std::uint64_t more = std::min<std::uint64_t>(std::max(kPiece, old), bytes - old);
    message.resize(old + static_cast<std::size_t>(more));
    if (!receive(message.data() + old, static_cast<std::size_t>(more))) fail();
  }
  if (kind == Kind::Data) return true;
  const std::string text(reinterpret_cast<const char*>(message.data()), message.size());
  if (kind == Kind::Input) throw InputError(text);
  if (kind == Kind::Machine) throw MachineError(text);
  return false;
}

}  // namespace mote
