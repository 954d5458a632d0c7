#include "host/core/foreign_lines.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <string>
#include <system_error>

#include "host/core/error_line.h"
#include "host/core/log_event.h"

namespace mote {
namespace {

void tell(const std::string& line) {
  if (!line.empty()) logEvent("info", {{"message", line}, {"source", "stderr"}});
}

}  // namespace

ForeignLines::ForeignLines() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
  stderr_ = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  pipe_ = ends[0];
  try {
    if (stderr_ >= 0) reader_ = std::thread([this] { read(); });
  } catch (const std::system_error&) {
    // No thread: they stay what they are.
  }
  if (reader_.joinable()) {
    writeErrorLinesTo(stderr_);
    ::dup2(ends[1], STDERR_FILENO);
  }
  ::close(ends[1]);
}

ForeignLines::~ForeignLines() {
  if (reader_.joinable()) {
    ::dup2(stderr_, STDERR_FILENO);
    writeErrorLinesTo(STDERR_FILENO);
    ending_ = true;
    reader_.join();
  }
  for (const int handle : {stderr_, pipe_})
    if (handle >= 0) ::close(handle);
}

/// Until it is told to end and nothing more is there. Not until the pipe's end: a child may hold that for long.
void ForeignLines::read() {
  constexpr int kLook = 20;  // milliseconds between two looks at `ending_`
  std::string text;
  for (;;) {
    pollfd wait{pipe_, POLLIN, 0};
    const bool ending = ending_;
    if (::poll(&wait, 1, ending ? 0 : kLook) <= 0 || (wait.revents & POLLIN) == 0) {
      if (ending || (wait.revents & POLLHUP) != 0) break;
      continue;
    }
    std::array<char, 4096> bytes;
    const ssize_t got = ::read(pipe_, bytes.data(), bytes.size());
    if (got <= 0) break;
    text.append(bytes.data(), static_cast<std::size_t>(got));
    for (std::size_t end = 0; (end = text.find('\n')) != std::string::npos; text.erase(0, end + 1))
      tell(text.substr(0, end));
  }
  tell(text);
}

}  // namespace mote
