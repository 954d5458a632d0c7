#include "host/particles/formats/prt2_reader.h"

#include <fmt/format.h>
#include <lz4.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <new>
#include <optional>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/number_visit.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

constexpr unsigned char kMagic[8] = {0xC0, 'P', 'R', 'T', '2', '\r', '\n', 0x1A};
constexpr std::uint32_t kVersion = 3;
constexpr std::uint64_t kMostChannelBytes = 50000;  // as its makers' reader has it
constexpr std::uint64_t kMostMetadataBytes = 1 << 20, kMostParticleBytes = 1 << 20;
constexpr std::uint64_t kNotClosed = ~std::uint64_t{0};
/// Ends hints about files of which particles can be saved.
constexpr const char* kRepair = "; mote repair IN OUT saves the particles that are there";
/// LZ4 counts in int.
constexpr std::uint64_t kMostBlockBytes = std::uint64_t{1} << 30;

/// "float32" or "3 * float32", with any blanks.
std::optional<std::pair<NumberType, std::uint32_t>> typeAndArity(std::string text) {
  std::erase(text, ' ');
  std::uint32_t arity = 1;
  if (const std::size_t times = text.find('*'); times != text.npos) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + times, arity);
    if (error != std::errc() || end != text.data() + times || arity == 0) return std::nullopt;
    text.erase(0, times + 1);
  }
  const std::optional<NumberType> type = numberNamed(text);
  if (!type) return std::nullopt;
  return std::pair(*type, arity);
}

/// Unpacks a block into `to`, which it must fill.
void unpack(const std::string& path, bool lz4, std::span<const std::byte> from, std::span<std::byte> to,
            std::uint64_t particle) {
  std::uint64_t size = 0;
  if (lz4) {
    const int got = LZ4_decompress_safe(reinterpret_cast<const char*>(from.data()), reinterpret_cast<char*>(to.data()),
                                        static_cast<int>(from.size()), static_cast<int>(to.size()));
    size = got < 0 ? 0 : static_cast<std::uint64_t>(got);
  } else {
    uLongf got = to.size();
    const int status =
        uncompress(reinterpret_cast<Bytef*>(to.data()), &got, reinterpret_cast<const Bytef*>(from.data()), from.size());
    if (status == Z_MEM_ERROR) throw MachineError(fmt::format("{}: zlib is out of memory", path));
    size = status == Z_OK ? got : 0;
  }
  if (size != to.size())
    throw InputError(path, fmt::format("block at particle {}", particle),
                     fmt::format("{} bytes of particles in valid {} data", to.size(), lz4 ? "LZ4" : "zlib"),
                     size > 0 ? fmt::format("{} bytes", size) : "something else",
                     fmt::format("the file is damaged{}", kRepair));
}

/// Byte k of particle j stands at j + k · count: back to one particle behind the other.
void untranspose(std::span<const std::byte> from, std::size_t count, std::span<std::byte> to) {
  const std::size_t size = count > 0 ? from.size() / count : 0;
  for (std::size_t k = 0; k < size; ++k)
    for (std::size_t j = 0; j < count; ++j) to[j * size + k] = from[k * count + j];
}

}  // namespace

/// A block's particles, one behind the other.
struct Prt2Reader::Block {
  std::vector<std::byte> rows, turned;
  std::vector<double> positions;  ///< where blocks have offsets
  std::size_t count = 0;
};

/// A chunk of the file.
class Prt2Reader::Chunk : public Section {
 public:
  Chunk(const InputFile& file, std::string kind, std::uint64_t begin, std::uint64_t end)
      : Section(file, begin, end), path_(file.path()), kind_(std::move(kind)) {}

  std::string what() const { return fmt::format("chunk {} at byte {}", shown(kind_), position()); }
  std::string bytes(std::uint64_t count) { return Section::bytes(count, what()); }
  template <class T>
  T number() {
    return Section::number<T>(what());
  }
  /// LEB128, at most ten bytes.
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 70; shift += 7) {
      const auto byte = static_cast<unsigned char>(bytes(1)[0]);
      if (shift == 63 && byte > 1) break;
      value |= std::uint64_t{byte & 0x7fu} << shift;
      if ((byte & 0x80) == 0) return value;
    }
    throw InputError(path_, what(), "a number of at most ten bytes", "more", "the file is damaged");
  }
  std::string text() {
    const std::uint64_t size = varint();
    return bytes(size);
  }

 private:
  const std::string& path_;
  std::string kind_;
};

bool beginsAsPrt2(std::span<const std::byte> start) {
  return start.size() >= sizeof kMagic && std::memcmp(start.data(), kMagic, sizeof kMagic) == 0;
}

Prt2Reader::Prt2Reader(std::string path, WhatIsWrong* salvage) : ParticleFile(path), file_(std::move(path)) {
  Chunk start(file_, "magic number", 0, file_.bytes());
  if (std::memcmp(start.bytes(sizeof kMagic).data(), kMagic, sizeof kMagic) != 0)
    throw InputError(path_, "PRT 2 magic number", "\\xC0PRT2\\r\\n\\x1A", "something else");
  if (const auto version = start.number<std::uint32_t>(); version != kVersion)
    throw InputError(path_, "PRT 2 version", fmt::format("{}", kVersion), fmt::format("{}", version));
  std::vector<Stream> streams;
  std::vector<std::string> indexed;
  std::uint64_t at = start.position();
  try {
    while (at < file_.bytes() && readChunk(at, streams, indexed, salvage != nullptr)) {
    }
  } catch (const InputError&) {
    if (!salvage || streams.empty()) throw;  // what is wrong behind the particles does them no harm
  }
  choose(streams, indexed, salvage);
  format_ = stream_.name.empty() ? "PRT 2" : "SPRT, " + stream_.name;
}

/// Reads the chunk at `at` and moves there behind it. False: what follows cannot be found.
bool Prt2Reader::readChunk(std::uint64_t& at, std::vector<Stream>& streams, std::vector<std::string>& indexed,
                           bool salvage) {
  Chunk head(file_, "a chunk's head", at, file_.bytes());
  const std::string kind = head.bytes(4);
  const bool particles = kind == "Part" || kind == "PrtO";
  auto size = head.number<std::uint64_t>();
  if (salvage && particles && size == 0) size = head.left();  // its writer did not come to it
  if (size > head.left()) {
    if (!salvage || !particles)
      throw InputError(path_, fmt::format("chunk {} at byte {}", shown(kind), at),
                       fmt::format("at most {} bytes", head.left()), fmt::format("{}", size),
                       fmt::format("the file is cut off or damaged{}", particles ? kRepair : ""));
    size = head.left();
  }
  Chunk chunk(file_, kind, head.position(), head.position() + size);
  if ((kind == "Chan") != channels_.empty())
    throw InputError(path_, fmt::format("chunk {} at byte {}", shown(kind), at), "'Chan' first, once", shown(kind));
  at = chunk.end();
  if (kind == "Chan")
    readChannels(chunk);
  else if (kind == "Meta")
    readMetadata(chunk);
  else if (particles)
    streams.push_back(readStream(chunk, kind == "PrtO", salvage));
  else if (kind == "PIdx" && !salvage)
    checkIndex(chunk, streams, indexed);
  return !(particles && salvage && streams.back().particles == kNotClosed);  // nor was its chunk's size written then
}

void Prt2Reader::readChannels(Chunk& chunk) {
  if (chunk.left() > kMostChannelBytes)
    throw InputError(path_, chunk.what(), fmt::format("at most {} bytes", kMostChannelBytes),
                     fmt::format("{}", chunk.left()));
  const std::uint64_t count = chunk.varint();
  requireFewChannels(path_, count);
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::string name = chunk.text(), type = chunk.text();
    const std::uint64_t size = chunk.varint();
    const auto known = typeAndArity(type);
    const std::string what = fmt::format("channel {}", shown(name));
    if (!known) throw InputError(path_, what, "a type like float32 or 3 * float32", shown(type));
    if (size != numberSize(known->first) * std::uint64_t{known->second})
      throw InputError(path_, what,
                       fmt::format("the {} bytes of {}", numberSize(known->first) * std::uint64_t{known->second}, type),
                       fmt::format("{}", size));
    if (name.empty() || channel(name)) throw InputError(path_, what, "a name that no other channel has", shown(name));
    if (size > kMostParticleBytes - particleBytes_)
      throw InputError(path_, what, fmt::format("at most {} bytes a particle", kMostParticleBytes), "more");
    channels_.push_back({name, known->first, known->second});
    offsets_.push_back(particleBytes_);
    particleBytes_ += size;
  }
  if (channels_.empty()) throw InputError(path_, "chunk 'Chan'", "at least one channel", "none");
}

void Prt2Reader::readMetadata(Chunk& chunk) {
  if (chunk.left() > kMostMetadataBytes) return logWarning(fmt::format("{}: left out {}", path_, chunk.what()));
  std::string name = chunk.text();
  const std::string type = chunk.text();
  Metadata entry;
  if (const std::size_t dot = name.find('.'); dot != name.npos && channel(name.substr(0, dot)))
    entry.channel = name.substr(0, dot), name.erase(0, dot + 1);
  entry.name = std::move(name);
  if (meta(entry.channel, entry.name))
    throw InputError(path_, chunk.what(), "metadata of different names", shown(entry.name));
  if (type == "string") {
    entry.bytes = chunk.text();
  } else if (const auto known = typeAndArity(type)) {
    entry.type = static_cast<std::int32_t>(known->first);
    entry.bytes = chunk.bytes(chunk.left());
    if (entry.bytes.size() % numberSize(known->first) != 0)
      throw InputError(path_, fmt::format("metadata {}", shown(entry.name)), "whole numbers of " + type,
                       fmt::format("{} bytes", entry.bytes.size()));
  } else {
    return logWarning(fmt::format("{}: left out metadata {}, whose type is {}", path_, shown(entry.name), shown(type)));
  }
  metadata_.push_back(std::move(entry));
}

Prt2Reader::Stream Prt2Reader::readStream(Chunk& chunk, bool offsets, bool salvage) const {
  Stream stream;
  stream.name = chunk.text(), stream.compression = chunk.text();
  stream.particles = chunk.number<std::uint64_t>(), stream.blocks = chunk.number<std::uint64_t>();
  stream.begin = chunk.position(), stream.end = chunk.end();
  stream.offsets = offsets;
  const std::string& c = stream.compression;
  const std::string packing = c.starts_with("transpose-") ? c.substr(10) : c;
  stream.transposed = c.starts_with("transpose"), stream.deflated = packing == "zlib", stream.lz4 = packing == "lz4";
  if (!stream.packed() && c != "uncompressed" && c != "transpose")
    throw InputError(path_, fmt::format("stream {}", shown(stream.name)),
                     "uncompressed, zlib, lz4, transpose, transpose-zlib or transpose-lz4", shown(c));
  if (stream.blocks == kNotClosed || stream.particles == kNotClosed) {
    if (!salvage)
      throw InputError(path_, fmt::format("stream {}", shown(stream.name)), "a count of particles",
                       "none: it was not closed", fmt::format("whatever wrote it stopped before its end{}", kRepair));
    stream.particles = stream.blocks = kNotClosed, stream.end = file_.bytes();
  }
  return stream;
}

/// An index has the size and the particles of each block: both must be what the stream says of itself.
void Prt2Reader::checkIndex(Chunk& chunk, std::span<const Stream> streams, std::vector<std::string>& indexed) const {
  const std::string name = chunk.text();
  const auto stream = std::find_if(streams.begin(), streams.end(), [&](const Stream& s) { return s.name == name; });
  if (stream == streams.end())
    throw InputError(path_, "index", "one of a stream before it", shown(name),
                     fmt::format("the file is damaged{}", kRepair));
  const auto count = chunk.number<std::uint64_t>();
  std::uint64_t bytes = 0, particles = 0;
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::uint64_t size = chunk.varint(), here = chunk.varint();
    if (size > stream->end - stream->begin - bytes || here > stream->particles - particles)
      throw InputError(path_, fmt::format("index of stream {}", shown(name)), "blocks within the stream",
                       fmt::format("more from block {} on", k), fmt::format("the file is damaged{}", kRepair));
    bytes += size, particles += here;
  }
  if (count != stream->blocks || bytes != stream->end - stream->begin || particles != stream->particles)
    throw InputError(path_, fmt::format("index of stream {}", shown(name)),
                     fmt::format("{} blocks, {} bytes, {} particles", stream->blocks, stream->end - stream->begin,
                                 stream->particles),
                     fmt::format("{}, {}, {}", count, bytes, particles),
                     fmt::format("the file is cut off or damaged{}", kRepair));
  indexed.push_back(name);
}

void Prt2Reader::choose(std::span<const Stream> streams, std::span<const std::string> indexed, WhatIsWrong* salvage) {
  if (streams.empty())
    throw InputError(path_, "", "a stream of particles (chunk 'Part' or 'PrtO')", "none",
                     "the file is cut off, or whatever wrote it stopped before its end");
  const Stream* best = &streams[0];
  for (const Stream& stream : streams) {
    if (!salvage && std::find(indexed.begin(), indexed.end(), stream.name) == indexed.end())
      throw InputError(path_, fmt::format("stream {}", shown(stream.name)), "an index (chunk 'PIdx')", "none",
                       fmt::format("the file is cut off, or whatever wrote it stopped before its end{}", kRepair));
    if (!best->name.empty() && (stream.name.empty() || stream.particles > best->particles)) best = &stream;
  }
  stream_ = *best;
  count_ = stream_.particles;
  const std::uint64_t bytes = stream_.end - stream_.begin, most = stream_.packed() ? bytes * kDeflateExpansion : bytes;
  if (!salvage && count_ > most / particleBytes_)
    throw InputError(path_, "particle count",
                     fmt::format("at most {}, what {} bytes can hold", most / particleBytes_, bytes),
                     fmt::format("{}", count_), fmt::format("the file is damaged{}", kRepair));
  for (std::size_t k = 0; stream_.offsets && k < channels_.size(); ++k)
    if (channels_[k].name == "Position" && channels_[k].arity == 3) {
      position_ = k, storedPosition_ = channels_[k].type;
      channels_[k].type = NumberType::F64;
    }
  if (salvage) countWhole(*salvage);
}

void Prt2Reader::countWhole(WhatIsWrong& wrong) {
  const Stream asWritten = stream_;
  if (asWritten.particles != kNotClosed) wrong.promised = asWritten.particles;
  Chunk blocks(file_, "Part", stream_.begin, stream_.end);
  Block block;
  stream_.blocks = 0, stream_.particles = 0, count_ = kNotClosed;  // for the while: any number may come
  while (blocks.left() > 0) {
    try {
      readBlock(blocks, stream_.particles, block);
    } catch (const InputError& error) {
      wrong.sentence = std::string(error.what()).substr(path_.size() + 2);
      break;
    }
    stream_.particles += block.count, ++stream_.blocks;
    stream_.end = blocks.position();
  }
  count_ = stream_.particles;
  if (!wrong.sentence.empty()) return;
  if (!wrong.promised)
    wrong.sentence = "the number of particles was never written; every block that was begun is there";
  else if (*wrong.promised != count_)
    wrong.sentence = fmt::format("the header promises {}", *wrong.promised);
}

/// The next block, unpacked; `done` particles are in front of it.
void Prt2Reader::readBlock(Chunk& blocks, std::uint64_t done, Block& block) const {
  const auto fail = [&](const std::string& expected, const std::string& got) {
    throw InputError(path_, fmt::format("block at particle {}", done), expected, got,
                     fmt::format("the file is damaged{}", kRepair));
  };
  std::uint64_t bytes = blocks.number<std::uint32_t>();
  const std::uint64_t here = blocks.number<std::uint32_t>();
  if (here > count_ - done) fail(fmt::format("at most {} particles", count_ - done), fmt::format("{}", here));
  float offset[3] = {};
  if (stream_.offsets) {
    if (bytes < sizeof offset) fail("an offset of 12 bytes", fmt::format("{}", bytes));
    for (float& number : offset) number = blocks.number<float>();
    bytes -= sizeof offset;
  }
  const std::uint64_t size = here * particleBytes_;
  if (stream_.packed() ? size > std::min(bytes * kDeflateExpansion, kMostBlockBytes) : size != bytes)
    fail(fmt::format("the bytes of {} particles", here), fmt::format("{}", bytes));
  const std::string data = blocks.bytes(bytes);
  const auto raw = std::as_bytes(std::span(data));
  block.count = here;
  block.rows.resize(size);
  if (here == 0) return;
  if (stream_.packed())
    unpack(path_, stream_.lz4, raw, block.rows, done);
  else
    std::copy(raw.begin(), raw.end(), block.rows.begin());
  if (stream_.transposed) {
    block.turned.resize(size);
    untranspose(block.rows, here, block.turned);
    block.rows.swap(block.turned);
  }
  if (position_ >= channels_.size()) return;
  block.positions.resize(3 * here);
  withNumberType(storedPosition_, [&]<class T>(T) {
    for (std::size_t i = 0; i < block.positions.size(); ++i) {
      T number;
      std::memcpy(&number, &block.rows[i / 3 * particleBytes_ + offsets_[position_] + i % 3 * sizeof(T)], sizeof(T));
      block.positions[i] = static_cast<double>(number) + static_cast<double>(offset[i % 3]);
    }
  });
}

void Prt2Reader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  Chunk blocks(file_, "Part", stream_.begin, stream_.end);
  std::uint64_t done = 0;
  Block block;
  try {
    for (ChannelSink& sink : sinks) sink.reserve(std::min<std::uint64_t>(count_, 1 << 20));
    for (std::uint64_t k = 0; k < stream_.blocks; ++k) {
      readBlock(blocks, done, block);
      if (block.count == 0) continue;
      for (ChannelSink& sink : sinks)
        if (sink.index() == position_)
          sink.append(reinterpret_cast<const std::byte*>(block.positions.data()), 3 * sizeof(double), block.count);
        else
          sink.append(block.rows.data() + offsets_[sink.index()], particleBytes_, block.count);
      done += block.count;
    }
    if (done != count_)
      throw InputError(path_, "particle data", fmt::format("{} particles in all", count_), fmt::format("{}", done),
                       fmt::format("the file is damaged{}", kRepair));
  } catch (const std::bad_alloc&) {
    throw MachineError(
        fmt::format("{}: not enough memory for {} particles of {} bytes", path_, count_, particleBytes_));
  }
}

}  // namespace mote
