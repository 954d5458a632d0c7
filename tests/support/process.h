// Runs a program to its end and keeps what it said.
#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mote::test {

struct ProcessOptions {
  std::map<std::string, std::string> environment = {};  ///< added to this process's own
  std::optional<rlim_t> largestFile = {};               ///< RLIMIT_FSIZE [bytes]: a disk that is full
  std::string outputFile = {};                          ///< stdout goes there instead of into the result
  int signal = SIGINT;
  std::function<bool()> signalWhen = {};  ///< asked every few milliseconds; `signal` is sent once it is true …
  std::string signalAt = {};              ///< … or once stderr has this text
  bool terminal = false;                  ///< stderr is a terminal of 160 columns
};

struct ProcessResult {
  int exitCode = -1;  ///< −signal where one ended it
  std::string out, err;
};

namespace detail {

/// Array of pointers that execve takes; the strings must outlive it.
inline std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> list;
  for (std::string& text : texts) list.push_back(text.data());
  list.push_back(nullptr);
  return list;
}

inline std::vector<std::string> environmentWith(const std::map<std::string, std::string>& added) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry; ++entry) {
    const std::string text(*entry);
    if (!added.contains(text.substr(0, text.find('=')))) all.push_back(text);
  }
  for (const auto& [name, value] : added) all.push_back(name + "=" + value);
  return all;
}

/// Only what may be called between fork and execve.
[[noreturn]] inline void becomeProgram(char** arguments, char** environment, int out, int err,
                                       const ProcessOptions& options) {
  if (!options.outputFile.empty()) out = ::open(options.outputFile.c_str(), O_WRONLY);
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) ::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const rlimit noCore{0, 0};
  ::setrlimit(RLIMIT_CORE, &noCore);
  if (options.largestFile) {
    const rlimit limit{*options.largestFile, *options.largestFile};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ::execve(arguments[0], arguments, environment);
  ::_exit(127);
}

/// A pipe, or a terminal of which the second is the program's end.
inline bool openChannel(bool terminal, std::array<int, 2>& ends) {
  if (!terminal) return ::pipe2(ends.data(), O_CLOEXEC) == 0;
  const winsize size{.ws_row = 24, .ws_col = 160, .ws_xpixel = 0, .ws_ypixel = 0};
  if (::openpty(&ends[0], &ends[1], nullptr, nullptr, &size) != 0) return false;
  for (const int end : ends) ::fcntl(end, F_SETFD, FD_CLOEXEC);
  return true;
}

}  // namespace detail

/// `arguments[0]` is the program's path. A program that runs longer than two minutes is killed, and that is a failure.
inline ProcessResult runProcess(std::vector<std::string> arguments, const ProcessOptions& options = {}) {
  std::vector<std::string> environment = detail::environmentWith(options.environment);
  std::vector<char*> argumentList = detail::pointers(arguments), environmentList = detail::pointers(environment);
  ProcessResult result;
  std::array<int, 2> out{}, err{};
  if (!detail::openChannel(false, out) || !detail::openChannel(options.terminal, err)) {
    ADD_FAILURE() << "no pipe, or no terminal";
    return result;
  }
  const pid_t child = ::fork();
  if (child == 0) detail::becomeProgram(argumentList.data(), environmentList.data(), out[1], err[1], options);
  ::close(out[1]);
  ::close(err[1]);

  std::array<pollfd, 2> open{pollfd{out[0], POLLIN, 0}, pollfd{err[0], POLLIN, 0}};
  std::array<std::string*, 2> texts{&result.out, &result.err};
  bool signalled = !options.signalWhen && options.signalAt.empty();
  const auto begin = std::chrono::steady_clock::now();
  while (open[0].fd >= 0 || open[1].fd >= 0) {
    ::poll(open.data(), open.size(), signalled ? 1000 : 2);
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (open[i].fd < 0 || open[i].revents == 0) continue;
      char bytes[4096];
      const ssize_t got = ::read(open[i].fd, bytes, sizeof bytes);
      if (got > 0) texts[i]->append(bytes, static_cast<std::size_t>(got));
      if (got <= 0) ::close(open[i].fd), open[i].fd = -1;  // the end of a terminal is an error
    }
    if (!signalled &&
        (options.signalWhen ? options.signalWhen() : result.err.find(options.signalAt) != std::string::npos))
      signalled = true, ::kill(child, options.signal);
    if (std::chrono::steady_clock::now() - begin > std::chrono::minutes(2)) {
      ADD_FAILURE() << arguments[0] << " ran for more than two minutes";
      ::kill(child, SIGKILL);
      break;
    }
  }
  for (const pollfd& left : open)
    if (left.fd >= 0) ::close(left.fd);
  int status = 0;
  ::waitpid(child, &status, 0);
  result.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  return result;
}

}  // namespace mote::test
