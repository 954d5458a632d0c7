#include "host/particles/formats/prt_writer.h"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <set>

#include "host/core/error.h"
#include "host/core/output_file.h"
#include "host/core/parallel.h"

namespace mote {
namespace {

// Each block is deflated without the window of the one before; at 1 MiB that costs under 0.5 % of size (window 32 KiB).
constexpr std::size_t kBlockBytes = 1 << 20;

template <class T>
void appendNumber(std::string& out, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof value);
  out.append(raw, sizeof raw);
}

void appendPadded(std::string& out, std::string_view text, std::size_t width) {
  out += text;
  out.append(width - text.size(), '\0');
}

void appendChunk(std::string& out, std::string_view kind, std::string_view data) {
  out += kind;
  appendNumber(out, static_cast<std::int32_t>(data.size()));
  out += data;
}

void appendMetadata(std::string& out, const Metadata& m) {
  MOTE_CHECK(m.name.size() + m.channel.size(), <=, std::size_t{62});
  std::string data = m.channel;
  data += '\0';
  data += m.name;
  data += '\0';
  appendNumber(data, m.type);
  data += m.bytes;
  if (m.type == kMetadataText) data += '\0';
  appendChunk(out, "Meta", data);
}

const PrtColumn& positionColumn(std::span<const PrtColumn> columns) {
  const auto found =
      std::find_if(columns.begin(), columns.end(), [](const PrtColumn& c) { return c.name == "Position"; });
  MOTE_CHECK(found != columns.end(), ==, true);
  MOTE_CHECK(static_cast<int>(found->type), ==, static_cast<int>(NumberType::F32));
  MOTE_CHECK(found->arity, ==, 3u);
  return *found;
}

/// Box of the positions; of no particles: empty, lo > hi, at the ends of float's range as other writers leave it.
std::vector<float> boundBox(const PrtColumn& position, std::size_t count) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  vec3 lo(kLargest), hi(-kLargest);
  for (std::size_t i = 0; i < count; ++i) {
    vec3 p;
    std::memcpy(&p, position.bytes.data() + i * sizeof p, sizeof p);
    lo = glm::min(lo, p), hi = glm::max(hi, p);
  }
  return {lo.x, lo.y, lo.z, hi.x, hi.y, hi.z};
}

struct Layout {
  std::vector<PrtChannel> channels;
  std::size_t particleBytes = 0, count = 0;
};

Layout layoutOf(const std::string& path, std::span<const PrtColumn> columns) {
  Layout layout;
  std::set<std::string> names;
  layout.count = positionColumn(columns).bytes.size() / sizeof(vec3);
  for (const PrtColumn& c : columns) {
    // Names may come from a scene (a light's, a mapped channel's), so a bad one is no bug.
    if (!prtNameIsValid(c.name))
      throw InputError(path, "channel name", "a letter or '_', then up to 30 letters, digits and '_'",
                       fmt::format("'{}'", c.name));
    MOTE_CHECK(names.insert(c.name).second, ==, true);
    layout.channels.push_back({{c.name, c.type, c.arity}, static_cast<std::uint32_t>(layout.particleBytes)});
    MOTE_CHECK(c.bytes.size(), ==, layout.count * layout.channels.back().bytes());
    layout.particleBytes += layout.channels.back().bytes();
  }
  return layout;
}

std::string headerBytes(const Layout& layout, std::span<const PrtColumn> columns, std::span<const Metadata> metadata,
                        const PrtWriteOptions& options) {
  std::string chunks;
  if (options.minorVersion == 1) {
    appendMetadata(chunks, Metadata::float32s("", "BoundBox", boundBox(positionColumn(columns), layout.count)));
    const auto isWritten = [&](const std::string& name) {
      return name.empty() ||
             std::any_of(columns.begin(), columns.end(), [&](const PrtColumn& c) { return c.name == name; });
    };
    for (const Metadata& m : metadata)
      if (isWritten(m.channel) && !(m.channel.empty() && m.name == "BoundBox")) appendMetadata(chunks, m);
    appendChunk(chunks, "Stop", "");
  }
  std::string out(reinterpret_cast<const char*>(kPrtMagic), sizeof kPrtMagic);
  appendNumber(out, static_cast<std::int32_t>(kPrtFixedHeader + chunks.size()));
  out.append(kPrtSignature, sizeof kPrtSignature);
  appendNumber(out, std::int32_t{options.minorVersion + 1});
  appendNumber(out, static_cast<std::int64_t>(layout.count));
  out += chunks;
  appendNumber(out, std::int32_t{4});
  appendNumber(out, static_cast<std::int32_t>(layout.channels.size()));
  appendNumber(out, static_cast<std::int32_t>(kPrtChannelRecord));
  for (const PrtChannel& c : layout.channels) {
    appendPadded(out, c.name, 32);
    appendNumber(out, static_cast<std::int32_t>(c.type));
    appendNumber(out, static_cast<std::int32_t>(c.arity));
    appendNumber(out, static_cast<std::int32_t>(c.offset));
  }
  return out;
}

/// A stretch of particles, deflated to a byte boundary so that the pieces, put together, are one deflate stream.
struct Piece {
  std::size_t begin = 0, end = 0;  ///< particles
  std::string deflated;
  uLong adler = 0;
  std::size_t rawBytes = 0;
};

std::vector<std::byte> interleave(const Layout& layout, std::span<const PrtColumn> columns, std::size_t begin,
                                  std::size_t end) {
  std::vector<std::byte> packed((end - begin) * layout.particleBytes);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const std::size_t bytes = layout.channels[k].bytes();
    const std::byte* from = columns[k].bytes.data() + begin * bytes;
    std::byte* to = packed.data() + layout.channels[k].offset;
    for (std::size_t i = begin; i < end; ++i, from += bytes, to += layout.particleBytes) std::memcpy(to, from, bytes);
  }
  return packed;
}

void deflatePiece(const std::vector<std::byte>& packed, int level, bool last, Piece& piece) {
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    throw MachineError("zlib cannot start compressing: out of memory");
  // deflateBound holds for Z_FINISH; a sync flush adds an empty stored block of 5 bytes and up to 7 bits.
  piece.deflated.resize(deflateBound(&stream, static_cast<uLong>(packed.size())) + 16);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(piece.deflated.data());
  stream.avail_out = static_cast<uInt>(piece.deflated.size());
  const int status = deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
  const bool done = last ? status == Z_STREAM_END : status == Z_OK && stream.avail_in == 0 && stream.avail_out > 0;
  piece.deflated.resize(stream.total_out);
  deflateEnd(&stream);
  MOTE_CHECK(done, ==, true);
  piece.rawBytes = packed.size();
  piece.adler = adler32_z(adler32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(packed.data()), packed.size());
}

class Sink {
 public:
  Sink(const std::string& path, const std::string& place) : place_(place), file_(std::fopen(path.c_str(), "wbe")) {
    if (!file_) throw MachineError(fmt::format("{}: cannot open: {}", place_, std::strerror(errno)));
  }
  void write(std::string_view bytes) {
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) refuse();
    written_ += bytes.size();
  }
  void close() {
    if (std::fclose(file_.release()) != 0) refuse();
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  [[noreturn]] void refuse() const {
    throw MachineError(fmt::format("{}: writing failed after {} bytes: {}", place_, written_, std::strerror(errno)));
  }
  const std::string& place_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t written_ = 0;
};

void writeParticles(Sink& sink, const Layout& layout, std::span<const PrtColumn> columns, int level) {
  const std::size_t perPiece = std::max<std::size_t>(1, kBlockBytes / layout.particleBytes);
  uLong adler = adler32_z(0, nullptr, 0);
  std::size_t next = 0, turn = 0;
  // Pieces leave the pipeline in order, so a slot is free again when its turn comes; and they are ours to delete if a
  // full disk cancels the pipeline half-way.
  std::vector<Piece> ring(2 * threadCount() + 2);
  // zlib header (RFC 1950): deflate with a 32 KiB window; the second byte makes the pair a multiple of 31.
  sink.write(std::string_view("\x78\x01", 2));
  const auto begin = [&](tbb::flow_control& flow) -> Piece* {
    if (turn > 0 && next == layout.count) return flow.stop(), nullptr;  // an empty file still gets one, empty, piece
    Piece& piece = ring[turn++ % ring.size()];
    piece.begin = next;
    piece.end = next = std::min(layout.count, next + perPiece);
    return &piece;
  };
  const auto compress = [&](Piece* piece) {
    deflatePiece(interleave(layout, columns, piece->begin, piece->end), level, piece->end == layout.count, *piece);
    return piece;
  };
  const auto write = [&](Piece* piece) {
    adler = adler32_combine(adler, piece->adler, static_cast<z_off_t>(piece->rawBytes));
    sink.write(piece->deflated);
  };
  using tbb::filter_mode;
  tbb::parallel_pipeline(ring.size(), tbb::make_filter<void, Piece*>(filter_mode::serial_in_order, begin) &
                                          tbb::make_filter<Piece*, Piece*>(filter_mode::parallel, compress) &
                                          tbb::make_filter<Piece*, void>(filter_mode::serial_in_order, write));
  const char checksum[4] = {static_cast<char>(adler >> 24), static_cast<char>(adler >> 16),
                            static_cast<char>(adler >> 8), static_cast<char>(adler)};
  sink.write(std::string_view(checksum, sizeof checksum));
}

}  // namespace

PrtColumn PrtColumn::of(std::string name, std::span<const float> values) {
  return {std::move(name), NumberType::F32, 1, std::as_bytes(values)};
}
PrtColumn PrtColumn::of(std::string name, std::span<const vec3> values) {
  return {std::move(name), NumberType::F32, 3, std::as_bytes(values)};
}
PrtColumn PrtColumn::of(std::string name, std::span<const std::uint64_t> values) {
  return {std::move(name), NumberType::U64, 1, std::as_bytes(values)};
}
PrtColumn PrtColumn::raw(std::string name, NumberType type, std::uint32_t arity, std::span<const std::byte> values) {
  return {std::move(name), type, arity, values};
}

void writePrt(const std::string& path, std::span<const PrtColumn> columns, std::span<const Metadata> metadata,
              const PrtWriteOptions& options) {
  MOTE_CHECK(options.minorVersion == 0 || options.minorVersion == 1, ==, true);
  const Layout layout = layoutOf(path, columns);
  OutputFile file(path);
  Sink sink(file.temporaryPath(), file.path());
  sink.write(headerBytes(layout, columns, metadata, options));
  writeParticles(sink, layout, columns, options.level);
  sink.close();
  file.commit();
}

std::vector<PrtColumn> columnsOf(const ParticleSet& set) {
  std::vector<PrtColumn> columns{PrtColumn::of("Position", set.position), PrtColumn::of("Radius", set.radius),
                                 PrtColumn::of("Density", set.density)};
  if (!set.color.empty()) columns.push_back(PrtColumn::of("Color", set.color));
  if (!set.absorption.empty()) columns.push_back(PrtColumn::of("Absorption", set.absorption));
  if (!set.emission.empty()) columns.push_back(PrtColumn::of("Emission", set.emission));
  if (!set.velocity.empty()) columns.push_back(PrtColumn::of("Velocity", set.velocity));
  if (!set.id.empty()) columns.push_back(PrtColumn::of("ID", set.id));
  return columns;
}

}  // namespace mote
