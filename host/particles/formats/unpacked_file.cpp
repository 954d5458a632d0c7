#include "host/particles/formats/unpacked_file.h"

#include <algorithm>
#include <cstring>

namespace mote {
namespace {

constexpr std::size_t kBufferBytes = 1 << 18;

}  // namespace

UnpackedFile::UnpackedFile(std::string path) : path_(std::move(path)) {
  if (beginsAsScf(InputFile(path_).start(4)))
    scf_ = std::make_unique<ScfFile>(path_);
  else
    gzip_ = std::make_unique<GzipFile>(path_);
  bufferBytes_ = scf_ ? kBufferBytes : std::min<std::uint64_t>(kBufferBytes, gzip_->mostBytes() + 1);
}

bool UnpackedFile::refill() {
  buffer_.resize(bufferBytes_);
  buffer_.resize(scf_ ? scf_->read(buffer_.data(), bufferBytes_) : gzip_->read(buffer_.data(), bufferBytes_));
  used_ = 0;
  return !buffer_.empty();
}

std::size_t UnpackedFile::read(std::byte* to, std::size_t wanted) {
  std::size_t done = 0;
  while (done < wanted && (used_ < buffer_.size() || refill())) {
    const std::size_t here = std::min(wanted - done, buffer_.size() - used_);
    std::memcpy(to + done, &buffer_[used_], here);
    done += here, used_ += here;
  }
  at_ += done;
  return done;
}

bool UnpackedFile::skip(std::uint64_t count) {
  while (count > 0 && (used_ < buffer_.size() || refill())) {
    const std::size_t here = std::min<std::uint64_t>(count, buffer_.size() - used_);
    used_ += here, at_ += here, count -= here;
  }
  return count == 0;
}

void UnpackedFile::seek(std::uint64_t position) {
  const std::uint64_t begin = at_ - used_;
  if (position >= begin && position - begin <= buffer_.size()) {
    used_ = static_cast<std::size_t>(position - begin);
  } else {
    scf_ ? scf_->seek(position) : gzip_->seek(position);
    buffer_.clear(), used_ = 0;
  }
  at_ = position;
}

}  // namespace mote
