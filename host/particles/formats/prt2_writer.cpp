#include "host/particles/formats/prt2_writer.h"

#include <fmt/format.h>
#include <lz4.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/particles/formats/prt_metadata.h"

namespace mote {
namespace {

constexpr std::string_view kMagic("\xC0PRT2\r\n\x1A", 8);
constexpr std::uint32_t kVersion = 3;
constexpr std::uint64_t kNotClosed = ~std::uint64_t{0};
constexpr std::size_t kMostChannelBytes = 50000;  // its makers' reader refuses more
// Blocks are compressed, and read, each by itself: some for every thread, and little lost at their ends.
constexpr std::size_t kBlockBytes = 1 << 20;

template <class T>
std::string raw(T value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

/// LEB128.
std::string varint(std::uint64_t value) {
  std::string bytes;
  for (; value >= 128; value >>= 7) bytes += static_cast<char>((value & 127) | 128);
  return bytes + static_cast<char>(value);
}

std::string varstring(std::string_view text) {
  std::string bytes = varint(text.size());
  return bytes.append(text);
}

std::string chunk(std::string_view kind, std::string_view data) {
  std::string bytes(kind);
  bytes += raw(static_cast<std::uint64_t>(data.size()));
  return bytes.append(data);
}

/// "float32", "3 * float32".
std::string typeName(NumberType type, std::size_t arity) {
  return arity == 1 ? std::string(numberName(type)) : fmt::format("{} * {}", arity, numberName(type));
}

std::string metadataChunk(const Metadata& m) {
  std::string data = varstring(m.channel.empty() ? m.name : m.channel + "." + m.name);
  if (m.type == kMetadataText) {
    data += varstring("string"), data += varstring(m.bytes);
  } else {
    const auto type = static_cast<NumberType>(m.type);
    data += varstring(typeName(type, m.bytes.size() / numberSize(type))), data += m.bytes;
  }
  return chunk("Meta", data);
}

/// Byte k of particle j stands at j + k · count.
std::vector<std::byte> transpose(std::span<const std::byte> rows, std::size_t rowBytes) {
  std::vector<std::byte> turned(rows.size());
  const std::size_t count = rows.size() / rowBytes;
  for (std::size_t k = 0; k < rowBytes; ++k)
    for (std::size_t j = 0; j < count; ++j) turned[k * count + j] = rows[j * rowBytes + k];
  return turned;
}

}  // namespace

struct Prt2Writer::Block {
  std::string bytes;
  std::uint64_t particles = 0;
};

Channel prt2Channel(const Channel& channel) {
  return channel.scale == 1 ? channel : Channel{channel.name, NumberType::F32, channel.arity};
}

bool storePrt2Metadata(Metadata& value) {
  toPrt2(value);
  return value.type == kMetadataText || !value.bytes.empty();  // its types have at least one number
}

Prt2Writer::Prt2Writer(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>& metadata,
                       const WriteOptions& options)
    : ParticleWriter(path, std::move(channels)), level_(options.level), box_(channels_, offsets_, rowBytes_) {
  const std::string compression = options.compression.empty() ? "transpose-zlib" : options.compression;
  transposed_ = compression.starts_with("transpose");
  const std::string packing = compression.starts_with("transpose-") ? compression.substr(10) : compression;
  deflated_ = packing == "zlib", lz4_ = packing == "lz4";
  if (!deflated_ && !lz4_ && compression != "uncompressed" && compression != "transpose")
    throw InputError("--compression", "", "uncompressed, zlib, lz4, transpose, transpose-zlib or transpose-lz4",
                     fmt::format("'{}'", compression));
  std::string table = varint(channels_.size());
  for (const Channel& c : channels_)
    table += varstring(c.name), table += varstring(typeName(c.type, c.arity)), table += varint(c.bytes());
  if (table.size() > kMostChannelBytes)
    throw InputError(path, "channels", fmt::format("a table of at most {} bytes, PRT 2's limit", kMostChannelBytes),
                     fmt::format("{}", table.size()), "write fewer of them (--channels)");
  out_.write(kMagic);
  out_.write(raw(kVersion));
  out_.write(chunk("Chan", table));
  for (const Metadata& m : metadata) out_.write(metadataChunk(m));
  chunkAt_ = out_.written();
  const std::string stream = varstring("") + varstring(compression);
  countsAt_ = chunkAt_ + 12 + stream.size();
  out_.write(chunk("Part", stream + raw(kNotClosed) + raw(kNotClosed)));
}

Prt2Writer::Block Prt2Writer::packed(std::span<const std::byte> rows) const {
  std::vector<std::byte> turned;
  if (transposed_) turned = transpose(rows, rowBytes_), rows = turned;
  std::string data;
  if (deflated_) {
    uLongf size = compressBound(static_cast<uLong>(rows.size()));
    data.resize(size);
    const int status = compress2(reinterpret_cast<Bytef*>(data.data()), &size,
                                 reinterpret_cast<const Bytef*>(rows.data()), static_cast<uLong>(rows.size()), level_);
    if (status != Z_OK) throw MachineError("zlib cannot compress: out of memory");
    data.resize(size);
  } else if (lz4_) {
    data.resize(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(rows.size()))));
    const int size = LZ4_compress_default(reinterpret_cast<const char*>(rows.data()), data.data(),
                                          static_cast<int>(rows.size()), static_cast<int>(data.size()));
    MOTE_CHECK(size, >, 0);
    data.resize(static_cast<std::size_t>(size));
  } else {
    data.assign(reinterpret_cast<const char*>(rows.data()), rows.size());
  }
  Block block;
  block.particles = rows.size() / rowBytes_;
  block.bytes = raw(static_cast<std::uint32_t>(data.size())) + raw(static_cast<std::uint32_t>(block.particles));
  block.bytes += data;
  return block;
}

void Prt2Writer::writeRows(std::span<const std::byte> rows, std::size_t) {
  box_.add(rows);
  pending_.insert(pending_.end(), rows.begin(), rows.end());
  if (pending_.size() > 4 * threadCount() * kBlockBytes) writePending(false);
}

void Prt2Writer::writePending(bool last) {
  const std::size_t blockBytes = std::max<std::size_t>(1, kBlockBytes / rowBytes_) * rowBytes_;
  const std::size_t whole = pending_.size() / blockBytes, used = last ? pending_.size() : whole * blockBytes;
  std::vector<Block> blocks((used + blockBytes - 1) / blockBytes);
  parallelBlocks(used, blockBytes, [&](std::size_t begin, std::size_t end) {
    blocks[begin / blockBytes] = packed(std::span(pending_).subspan(begin, end - begin));
  });
  for (const Block& block : blocks) {
    out_.write(block.bytes);
    index_ += varint(block.bytes.size()), index_ += varint(block.particles);
    ++blocks_;
  }
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(used));
}

void Prt2Writer::complete() {
  writePending(true);
  out_.replace(chunkAt_ + 4, raw(out_.written() - chunkAt_ - 12));
  out_.replace(countsAt_, raw(count_) + raw(blocks_));
  out_.write(chunk("PIdx", varstring("") + raw(blocks_) + index_));
  // What its makers have for PRT 1's BoundBox, in the type of the positions and behind the particles as theirs.
  if (!box_.hasPosition() || box_.empty()) return;
  const double box[6] = {box_.lo().x, box_.lo().y, box_.lo().z, box_.hi().x, box_.hi().y, box_.hi().z};
  Metadata extents{"Position", "Extents", static_cast<std::int32_t>(NumberType::F64), ""};
  extents.bytes.assign(reinterpret_cast<const char*>(box), sizeof box);
  for (const Channel& c : channels_)
    if (c.name == "Position" && c.type != NumberType::F64)
      extents = Metadata::float32s("Position", "Extents", std::vector<float>(std::begin(box), std::end(box)));
  out_.write(metadataChunk(extents));
}

}  // namespace mote
