#include "host/core/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "host/core/error.h"

namespace mote {
namespace fs = std::filesystem;

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
  const int handle = ::open(temporary_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0666);
  if (handle < 0) throw InputError(fmt::format("{}: cannot write there: {}", path_, std::strerror(errno)));
  ::close(handle);
}

OutputFile::~OutputFile() {
  if (!committed_) ::unlink(temporary_.c_str());
}

void OutputFile::commit() {
  const int handle = ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0) throw MachineError(fmt::format("{}: cannot reopen what was written: {}", path_, std::strerror(errno)));
  const int synced = ::fsync(handle);
  const int why = errno;
  ::close(handle);
  // Pipes and some network disks cannot sync; that is no lost data.
  if (synced != 0 && why != EINVAL && why != EROFS)
    throw MachineError(fmt::format("{}: writing failed: {}", path_, std::strerror(why)));
  if (::rename(temporary_.c_str(), path_.c_str()) != 0)
    throw MachineError(fmt::format("{}: cannot rename '{}' to it: {}", path_, temporary_, std::strerror(errno)));
  committed_ = true;
}

void writeWholeFile(const std::string& path, const std::string& bytes) {
  OutputFile file(path);
  std::FILE* stream = std::fopen(file.temporaryPath().c_str(), "wb");
  if (!stream) throw MachineError(fmt::format("{}: cannot open: {}", path, std::strerror(errno)));
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), stream) == bytes.size();
  const bool closed = std::fclose(stream) == 0;
  if (!written || !closed)
    throw MachineError(fmt::format("{}: writing {} bytes failed: {}", path, bytes.size(), std::strerror(errno)));
  file.commit();
}

}  // namespace mote
