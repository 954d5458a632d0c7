#include "host/particles/formats/prt_writer.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/particles/formats/prt_metadata.h"

namespace mote {
namespace {

// Each piece is deflated without the window of the one before; at 1 MiB that costs under 0.5 % of size (window 32 KiB).
constexpr std::size_t kPieceBytes = 1 << 20;
constexpr std::uint64_t kCountAt = 48;  ///< where the header has the number of particles
constexpr std::size_t kBoxBytes = 6 * sizeof(float);
constexpr std::size_t kPrtMostName = 31;

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

/// The box as the header has it; of no particles: empty, lo > hi, at the ends of float's range as other writers leave
/// it.
std::vector<float> boundBox(const RowBox& box) {
  const auto number = [](double value) {
    constexpr double kGreatest = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(value, -kGreatest, kGreatest));
  };
  return {number(box.lo().x), number(box.lo().y), number(box.lo().z),
          number(box.hi().x), number(box.hi().y), number(box.hi().z)};
}

/// Up to the particles; the count is −1, not closed. `boxAt`: where the numbers of the BoundBox stand.
std::string headerBytes(std::span<const Channel> channels, std::span<const std::size_t> offsets,
                        std::span<const Metadata> metadata, int minorVersion, const RowBox& box, std::uint64_t& boxAt) {
  std::string chunks;
  if (minorVersion == 1) {
    if (box.hasPosition()) {
      appendMetadata(chunks, Metadata::float32s("", "BoundBox", boundBox(box)));
      boxAt = kPrtFixedHeader + chunks.size() - kBoxBytes;
    }
    const auto isWritten = [&](const std::string& name) {
      return name.empty() ||
             std::any_of(channels.begin(), channels.end(), [&](const Channel& c) { return c.name == name; });
    };
    for (const Metadata& m : metadata)
      if (isWritten(m.channel) && !(m.channel.empty() && m.name == "BoundBox")) appendMetadata(chunks, m);
    appendChunk(chunks, "Stop", "");
  }
  std::string out(reinterpret_cast<const char*>(kPrtMagic), sizeof kPrtMagic);
  appendNumber(out, static_cast<std::int32_t>(kPrtFixedHeader + chunks.size()));
  out.append(kPrtSignature, sizeof kPrtSignature);
  appendNumber(out, std::int32_t{minorVersion + 1});
  appendNumber(out, std::int64_t{-1});
  out += chunks;
  appendNumber(out, std::int32_t{4});
  appendNumber(out, static_cast<std::int32_t>(channels.size()));
  appendNumber(out, static_cast<std::int32_t>(kPrtChannelRecord));
  for (std::size_t k = 0; k < channels.size(); ++k) {
    MOTE_CHECK(prtNameIsValid(channels[k].name), ==, true);
    appendPadded(out, channels[k].name, 32);
    appendNumber(out, static_cast<std::int32_t>(channels[k].type));
    appendNumber(out, static_cast<std::int32_t>(channels[k].arity));
    appendNumber(out, static_cast<std::int32_t>(offsets[k]));
  }
  return out;
}

/// A stretch of particles, deflated to a byte boundary so that the pieces, put together, are one deflate stream.
struct Piece {
  std::string deflated;
  uLong adler = 0;
  std::size_t rawBytes = 0;
};

Piece deflatePiece(std::span<const std::byte> rows, int level, bool last) {
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    throw MachineError("zlib cannot start compressing: out of memory");
  Piece piece;
  // deflateBound holds for Z_FINISH; a sync flush adds an empty stored block of 5 bytes and up to 7 bits.
  piece.deflated.resize(deflateBound(&stream, static_cast<uLong>(rows.size())) + 16);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(rows.data()));
  stream.avail_in = static_cast<uInt>(rows.size());
  stream.next_out = reinterpret_cast<Bytef*>(piece.deflated.data());
  stream.avail_out = static_cast<uInt>(piece.deflated.size());
  const int status = deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
  const bool done = last ? status == Z_STREAM_END : status == Z_OK && stream.avail_in == 0 && stream.avail_out > 0;
  piece.deflated.resize(stream.total_out);
  deflateEnd(&stream);
  MOTE_CHECK(done, ==, true);
  piece.rawBytes = rows.size();
  piece.adler = adler32_z(adler32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(rows.data()), rows.size());
  return piece;
}

bool isWordCharacter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
}

const PrtColumn& positionColumn(std::span<const PrtColumn> columns) {
  const auto found =
      std::find_if(columns.begin(), columns.end(), [](const PrtColumn& c) { return c.name == "Position"; });
  MOTE_CHECK(found != columns.end(), ==, true);
  MOTE_CHECK(static_cast<int>(found->type), ==, static_cast<int>(NumberType::F32));
  MOTE_CHECK(found->arity, ==, 3u);
  return *found;
}

/// Names may come from a scene (a light's, a mapped channel's), so a bad one is no bug.
void requireName(const std::string& path, const std::string& name) {
  if (!prtNameIsValid(name))
    throw InputError(path, "channel name", "a letter or '_', then up to 30 letters, digits and '_'",
                     fmt::format("'{}'", name));
}

}  // namespace

Channel prtChannel(const Channel& channel) {
  Channel stored = channel.scale == 1 ? channel : Channel{channel.name, NumberType::F32, channel.arity};
  for (char& c : stored.name)
    if (!isWordCharacter(c)) c = '_';
  if (stored.name[0] >= '0' && stored.name[0] <= '9') stored.name.insert(stored.name.begin(), '_');
  stored.name.resize(std::min(stored.name.size(), kPrtMostName));
  // Whole numbers are no places that its makers' readers take.
  if (stored.name == "Position" && stored.arity == 3) stored.type = NumberType::F32;
  return stored;
}

bool storePrtMetadata(Metadata& value) {
  toPrt1(value);
  return value.name.size() <= kPrtMostName && value.channel.size() <= kPrtMostName && !value.name.empty() &&
         value.name.find('.') == value.name.npos &&  // a reader would take what is before it for a channel
         (value.type != kMetadataText || value.bytes.find('\0') == value.bytes.npos);
}

PrtWriter::PrtWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>& metadata,
                     const WriteOptions& options, int minorVersion)
    : ParticleWriter(path, std::move(channels)),
      level_(options.level),
      minorVersion_(minorVersion),
      box_(channels_, offsets_, rowBytes_) {
  out_.write(headerBytes(channels_, offsets_, metadata, minorVersion_, box_, boxAt_));
  // zlib header (RFC 1950): deflate with a 32 KiB window; the second byte makes the pair a multiple of 31.
  out_.write(std::string_view("\x78\x01", 2));
}

void PrtWriter::writeRows(std::span<const std::byte> rows, std::size_t) {
  box_.add(rows);
  pending_.insert(pending_.end(), rows.begin(), rows.end());
  // As many as all threads can share; a piece of the last ones stays, as the stream's last is ended otherwise.
  if (pending_.size() > 4 * threadCount() * kPieceBytes) deflatePending(false);
}

void PrtWriter::deflatePending(bool last) {
  const std::size_t pieceBytes = std::max<std::size_t>(1, kPieceBytes / rowBytes_) * rowBytes_;
  const std::size_t whole = pending_.empty() ? 0 : (pending_.size() - 1) / pieceBytes;  // leaves at least a particle
  std::vector<Piece> pieces(whole + (last ? 1 : 0));
  parallelBlocks(pieces.size(), 1, [&](std::size_t k, std::size_t) {
    const std::span<const std::byte> rest = std::span(pending_).subspan(k * pieceBytes);
    pieces[k] =
        deflatePiece(rest.first(std::min(rest.size(), k < whole ? pieceBytes : rest.size())), level_, k == whole);
  });
  for (const Piece& piece : pieces) {
    adler_ = static_cast<std::uint32_t>(adler32_combine(adler_, piece.adler, static_cast<z_off_t>(piece.rawBytes)));
    out_.write(piece.deflated);
  }
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(whole * pieceBytes));
}

void PrtWriter::complete() {
  deflatePending(true);
  const char checksum[4] = {static_cast<char>(adler_ >> 24), static_cast<char>(adler_ >> 16),
                            static_cast<char>(adler_ >> 8), static_cast<char>(adler_)};
  out_.write(std::string_view(checksum, sizeof checksum));
  std::string count;
  appendNumber(count, static_cast<std::int64_t>(count_));
  out_.replace(kCountAt, count);
  if (boxAt_ > 0) out_.replace(boxAt_, Metadata::float32s("", "", boundBox(box_)).bytes);
}

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
  const std::size_t count = positionColumn(columns).bytes.size() / sizeof(vec3);
  std::vector<Channel> channels;
  std::vector<std::span<const std::byte>> bytes;
  for (const PrtColumn& c : columns) {
    requireName(path, c.name);
    channels.push_back({c.name, c.type, c.arity});
    bytes.push_back(c.bytes);
    MOTE_CHECK(c.bytes.size(), ==, count * channels.back().bytes());
  }
  PrtWriter writer(path, std::move(channels), {metadata.begin(), metadata.end()}, {.level = options.level},
                   options.minorVersion);
  writer.write(bytes);
  writer.finish();
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
