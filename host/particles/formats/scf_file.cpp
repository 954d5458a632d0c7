#include "host/particles/formats/scf_file.h"

#include <blosc.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "host/core/error.h"

namespace mote {
namespace {

constexpr char kMagic[] = {'s', 'c', 'f', '1'}, kEndMagic[] = {'1', 'f', 'c', 's'};
constexpr std::uint64_t kHead = 12, kFoot = 12;  ///< a magic number and a length
constexpr std::size_t kBlockHeader = BLOSC_MIN_HEADER_LENGTH;
constexpr std::uint32_t kMostBlock = 1 << 24;  ///< Houdini's have 64 KiB

std::uint64_t bigEndian64(const std::byte* from) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < 8; ++k) value = value << 8 | std::to_integer<std::uint64_t>(from[k]);
  return value;
}

}  // namespace

bool beginsAsScf(std::span<const std::byte> start) {
  return start.size() >= sizeof kMagic && std::memcmp(start.data(), kMagic, sizeof kMagic) == 0;
}

void ScfFile::fail(std::uint64_t place, const std::string& expected, const std::string& got) const {
  throw InputError(path(), fmt::format("Blosc block at byte {}", place), expected, got,
                   "the file is cut off or damaged; .bgeo instead of .bgeo.sc saves it without compression");
}

ScfFile::ScfFile(std::string path) : file_(std::move(path)) {
  const auto part = [&](std::uint64_t place, std::size_t size) {
    std::vector<std::byte> bytes(size);
    file_.seek(place);
    if (file_.read(bytes.data(), size) != size) fail(place, fmt::format("{} bytes", size), "the file's end");
    return bytes;
  };
  if (bytes() < kHead + kFoot) fail(0, fmt::format("{} bytes or more", kHead + kFoot), fmt::format("{}", bytes()));
  const std::vector<std::byte> head = part(0, kHead), foot = part(bytes() - kFoot, kFoot);
  if (std::memcmp(foot.data() + 8, kEndMagic, sizeof kEndMagic) != 0) fail(bytes() - 4, "1fcs", "something else");
  std::uint64_t left = bytes() - kHead - kFoot;  // of blocks
  for (const std::uint64_t length : {bigEndian64(head.data() + 4), bigEndian64(foot.data())}) {
    if (length > left)
      fail(0, fmt::format("metadata and an index of {} bytes at most", left), fmt::format("{}", length));
    left -= length;
  }
  std::uint64_t place = kHead + bigEndian64(head.data() + 4), begin = 0;
  while (left > 0) {
    if (left < kBlockHeader) fail(place, "a block's header", fmt::format("{} bytes", left));
    const std::vector<std::byte> header = part(place, kBlockHeader);
    std::size_t unpacked = 0, packed = 0, inner = 0;
    blosc_cbuffer_sizes(header.data(), &unpacked, &packed, &inner);
    if (packed < kBlockHeader || packed > left)
      fail(place, fmt::format("at most {} bytes", left), fmt::format("{}", packed));
    if (unpacked > kMostBlock)
      fail(place, fmt::format("{} bytes unpacked at most", kMostBlock), fmt::format("{}", unpacked));
    blocks_.push_back({place, begin, static_cast<std::uint32_t>(packed), static_cast<std::uint32_t>(unpacked)});
    place += packed, left -= packed, begin += unpacked;
    if (begin / kDeflateExpansion > bytes())
      fail(place, fmt::format("what {} bytes can be unpacked to", bytes()), fmt::format("more than {} bytes", begin));
  }
}

void ScfFile::unpack(std::size_t k) {
  const Block& block = blocks_[k];
  packed_.resize(block.packed), data_.resize(block.bytes);
  current_ = static_cast<std::size_t>(-1);
  file_.seek(block.place);
  std::size_t unpacked = 0;
  if (file_.read(packed_.data(), packed_.size()) != packed_.size() ||
      blosc_cbuffer_validate(packed_.data(), packed_.size(), &unpacked) != 0 || unpacked != data_.size() ||
      blosc_decompress_ctx(packed_.data(), data_.data(), data_.size(), 1) != static_cast<int>(data_.size()))
    fail(block.place, fmt::format("data that unpack to {} bytes", block.bytes), "something else");
  current_ = k;
}

std::size_t ScfFile::read(std::byte* to, std::size_t wanted) {
  std::size_t done = 0;
  while (done < wanted) {
    const auto next = std::upper_bound(blocks_.begin(), blocks_.end(), at_,
                                       [](std::uint64_t at, const Block& b) { return at < b.begin; });
    if (next == blocks_.begin()) break;
    const auto k = static_cast<std::size_t>(next - blocks_.begin()) - 1;
    const std::uint64_t from = at_ - blocks_[k].begin;
    if (from >= blocks_[k].bytes) break;  // behind the last one
    if (k != current_) unpack(k);
    const std::size_t here = std::min<std::uint64_t>(wanted - done, blocks_[k].bytes - from);
    std::memcpy(to + done, data_.data() + from, here);
    done += here, at_ += here;
  }
  return done;
}

}  // namespace mote
