#include "host/particles/formats/input_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
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

void GzipFile::Close::operator()(void* file) const { gzclose(static_cast<gzFile>(file)); }

GzipFile::GzipFile(std::string path) : path_(std::move(path)) {
  const InputFile plain(path_);
  bytes_ = plain.bytes();
  packed_ = beginsAsGzip(plain.start(2));
  file_.reset(gzopen(path_.c_str(), "rbe"));
  if (!file_) throw InputError(path_, "", "a readable file", std::strerror(errno));
}

void GzipFile::seek(std::uint64_t position) const {
  if (gzseek(static_cast<gzFile>(file_.get()), static_cast<z_off_t>(position), SEEK_SET) < 0)
    throw InputError(path_, "gzip data", "valid data", "something else", "the file is damaged");
}

std::size_t GzipFile::read(std::byte* to, std::size_t wanted) const {
  constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;  // zlib counts in int
  const auto file = static_cast<gzFile>(file_.get());
  std::size_t done = 0;
  while (done < wanted) {
    const auto here = static_cast<unsigned>(std::min(kMostAtOnce, wanted - done));
    const int got = gzread(file, to + done, here);
    int status = Z_OK;
    const char* message = gzerror(file, &status);
    if (got < 0 || (got == 0 && status != Z_OK && status != Z_BUF_ERROR))
      throw InputError(path_, "gzip data", "valid data", fmt::format("'{}'", message), "the file is damaged");
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

bool beginsAsGzip(std::span<const std::byte> start) {
  return start.size() >= 2 && start[0] == std::byte{0x1f} && start[1] == std::byte{0x8b};
}

std::vector<std::byte> unpackedStart(std::span<const std::byte> start, std::size_t most) {
  std::vector<std::byte> out(most);
  z_stream stream{};
  constexpr int kGzip = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzip) != Z_OK) throw MachineError("zlib cannot start");
  std::vector<std::byte> in(start.begin(), start.end());  // zlib takes no const
  stream.next_in = reinterpret_cast<Bytef*>(in.data()), stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data()), stream.avail_out = static_cast<uInt>(out.size());
  inflate(&stream, Z_SYNC_FLUSH);  // damaged data end where they do
  out.resize(out.size() - stream.avail_out);
  inflateEnd(&stream);
  return out;
}

}  // namespace mote
