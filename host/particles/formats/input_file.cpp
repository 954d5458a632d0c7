#include "host/particles/formats/input_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "host/core/error.h"

namespace mote {

InputFile::InputFile(std::string path) : path_(std::move(path)) {
  struct stat facts {};
  if (::stat(path_.c_str(), &facts) != 0) throw InputError(path_, "", "a readable file", std::strerror(errno));
  if (!S_ISREG(facts.st_mode))
    throw InputError(path_, "", "a file", S_ISDIR(facts.st_mode) ? "a folder" : "a device or pipe");
  file_.reset(std::fopen(path_.c_str(), "rbe"));
  if (!file_) throw InputError(path_, "", "a readable file", std::strerror(errno));
  bytes_ = static_cast<std::uint64_t>(facts.st_size);
}

void InputFile::seek(std::uint64_t position) const {
  if (fseeko(file_.get(), static_cast<off_t>(position), SEEK_SET) != 0)
    throw MachineError(fmt::format("{}: seeking to byte {} failed", path_, position));
}

std::size_t InputFile::read(std::byte* to, std::size_t wanted) const {
  const std::size_t got = std::fread(to, 1, wanted, file_.get());
  if (got < wanted && std::ferror(file_.get()))
    throw MachineError(fmt::format("{}: reading failed: {}", path_, std::strerror(errno)));
  return got;
}

std::vector<std::byte> InputFile::start(std::size_t most) const {
  seek(0);
  std::vector<std::byte> bytes(most);
  bytes.resize(read(bytes.data(), most));
  seek(0);
  return bytes;
}

}  // namespace mote
