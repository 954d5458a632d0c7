#include "host/particles/formats/prt_inflater.h"

#include <fmt/format.h>

#include "host/core/error.h"

namespace mote {
namespace {

constexpr std::size_t kInputBytes = 1 << 17;

}  // namespace

PrtInflater::PrtInflater(const InputFile& file) : file_(file), input_(kInputBytes) {
  if (inflateInit(&stream_) != Z_OK) throw MachineError(fmt::format("{}: zlib cannot start: {}", file.path(), why()));
}

std::size_t PrtInflater::fill(std::byte* out, std::size_t wanted) {
  stream_.next_out = reinterpret_cast<Bytef*>(out);
  stream_.avail_out = static_cast<uInt>(wanted);
  while (stream_.avail_out > 0 && !ended_ && !starved_ && !damaged()) {
    if (stream_.avail_in == 0 && !refill()) break;
    step();
  }
  return wanted - stream_.avail_out;
}

bool PrtInflater::refill() {
  const std::size_t got = file_.read(input_.data(), input_.size());
  bytesRead_ += got;
  stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
  stream_.avail_in = static_cast<uInt>(got);
  starved_ = got == 0;
  return got > 0;
}

void PrtInflater::step() {
  const int status = inflate(&stream_, Z_NO_FLUSH);
  if (status == Z_STREAM_END)
    ended_ = true;
  else if (status == Z_MEM_ERROR)
    throw MachineError(fmt::format("{}: zlib is out of memory", file_.path()));
  else if (status != Z_OK && status != Z_BUF_ERROR)
    damage_ = status == Z_NEED_DICT ? "it asks for a preset dictionary" : why();
}

}  // namespace mote
