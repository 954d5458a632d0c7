#include "host/particles/formats/output_stream.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "host/core/error.h"

namespace mote {

OutputStream::OutputStream(const std::string& path)
    : file_(path), stream_(std::fopen(file_.temporaryPath().c_str(), "wbe")) {
  if (!stream_) throw MachineError(fmt::format("{}: cannot open: {}", path, std::strerror(errno)));
}

void OutputStream::write(std::string_view bytes) {
  if (bytes.empty()) return;
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_.get()) != bytes.size()) refuse();
  written_ += bytes.size();
}

void OutputStream::replace(std::uint64_t at, std::string_view bytes) {
  MOTE_CHECK(at + bytes.size(), <=, written_);
  if (fseeko(stream_.get(), static_cast<off_t>(at), SEEK_SET) != 0) refuse();
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_.get()) != bytes.size()) refuse();
  if (fseeko(stream_.get(), static_cast<off_t>(written_), SEEK_SET) != 0) refuse();
}

void OutputStream::commit() {
  if (std::fclose(stream_.release()) != 0) refuse();
  file_.commit();
}

void OutputStream::refuse() const {
  throw MachineError(fmt::format("{}: writing failed after {} bytes: {}", path(), written_, std::strerror(errno)));
}

}  // namespace mote
