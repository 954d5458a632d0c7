#include "host/core/error_line.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <string>

namespace mote {
namespace {

constexpr std::string_view kWipe = "\r\033[K";

std::mutex& lineMutex() {
  static auto* const mutex = new std::mutex;  // never destroyed: threads may still write while the process ends
  return *mutex;
}
bool barStands = false;
int output = STDERR_FILENO;

/// One write, so that lines of several processes stay whole too. What stderr refuses is lost: nobody can be told.
void write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(output, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

void writeErrorLine(std::string_view text) {
  const std::scoped_lock lock(lineMutex());
  std::string line(barStands ? kWipe : "");
  barStands = false;
  write(line.append(text).append("\n"));
}

void writeErrorLinesTo(int descriptor) {
  const std::scoped_lock lock(lineMutex());
  output = descriptor;
}

bool barsAreDrawn() {
  const char* terminal = std::getenv("TERM");
  return ::isatty(STDERR_FILENO) != 0 && !(terminal && std::string_view(terminal) == "dumb");
}

std::size_t barColumns() {
  constexpr std::size_t kUnknown = 80;  // what terminals have had since punched cards
  winsize size{};
  const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return (known ? size.ws_col : kUnknown) - 1;  // a full line may wrap
}

void drawBar(std::string_view text) {
  const std::scoped_lock lock(lineMutex());
  barStands = true;
  write(std::string(kWipe).append(text.substr(0, barColumns())));
}

void wipeBar() {
  const std::scoped_lock lock(lineMutex());
  if (barStands) write(kWipe);
  barStands = false;
}

}  // namespace mote
