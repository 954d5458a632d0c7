#include "host/particles/formats/npy_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>
#include <new>
#include <optional>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

constexpr char kMagic[] = {'\x93', 'N', 'U', 'M', 'P', 'Y'};
/// No writer comes near; it keeps what is read in front of the data small.
constexpr std::uint64_t kMostHeader = 1 << 20;
constexpr std::uint64_t kMostRowBytes = 1 << 20;
constexpr std::size_t kBlockBytes = 1 << 19;

/// A field of the array's type.
struct Field {
  std::string name;
  std::string type;                  ///< "<f4"
  std::vector<std::uint64_t> shape;  ///< of a subarray
};

/// The header's dictionary, as far as Python's literals of it go.
class Header {
 public:
  Header(const std::string& path, std::string text) : path_(path), text_(std::move(text)) { parse(); }

  std::vector<Field> fields;  ///< one without a name where the type is a number
  bool structured = false, fortranOrder = false;
  std::vector<std::uint64_t> shape;

 private:
  [[noreturn]] void fail(const std::string& expected) const {
    const std::string got = text_.substr(std::min(at_, text_.size()), 30);
    throw InputError(path_, fmt::format("NPY header, character {}", at_), expected,
                     got.empty() ? "the header's end" : shown(got));
  }

  void skipSpace() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  bool take(char c) {
    skipSpace();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void need(char c) {
    if (!take(c)) fail(fmt::format("'{}'", c));
  }
  bool next(char c) {
    skipSpace();
    return at_ < text_.size() && text_[at_] == c;
  }
  bool isText() { return next('\'') || next('"'); }

  std::string text() {
    skipSpace();
    if (!isText()) fail("a text in quotes");
    const char quote = text_[at_++];
    std::string value;
    while (at_ < text_.size() && text_[at_] != quote) {
      if (text_[at_] == '\\') ++at_;
      if (at_ < text_.size()) value += text_[at_++];
    }
    need(quote);
    return value;
  }

  std::uint64_t number() {
    skipSpace();
    std::uint64_t value = 0;
    const std::size_t begin = at_;
    for (; at_ < text_.size() && std::isdigit(static_cast<unsigned char>(text_[at_])) != 0; ++at_) {
      const auto digit = static_cast<std::uint64_t>(text_[at_] - '0');
      if (value > (std::numeric_limits<std::uint64_t>::max() - digit) / 10) fail("a number below 2^64");
      value = value * 10 + digit;
    }
    if (at_ == begin) fail("a whole number");
    if (at_ < text_.size() && text_[at_] == 'L') ++at_;  // of Python 2
    return value;
  }

  std::vector<std::uint64_t> tuple() {
    std::vector<std::uint64_t> values;
    need('(');
    while (!take(')')) {
      values.push_back(number());
      if (!take(',')) {
        need(')');
        break;
      }
    }
    return values;
  }

  void field() {
    Field one;
    need('(');
    if (take('(')) {  // (title, name)
      text(), need(','), one.name = text(), need(')');
    } else {
      one.name = text();
    }
    need(',');
    if (next('[')) fail("a number's type: fields of fields are not read");
    one.type = text();
    if (take(',') && !next(')')) one.shape = next('(') ? tuple() : std::vector<std::uint64_t>{number()};
    take(',');
    need(')');
    fields.push_back(std::move(one));
  }

  void type() {
    if (isText()) {
      fields.push_back({"", text(), {}});
      return;
    }
    structured = true;
    need('[');
    while (!take(']')) {
      field();
      if (!take(',')) {
        need(']');
        break;
      }
    }
  }

  bool truth() {
    skipSpace();
    for (const auto& [word, value] : {std::pair<std::string_view, bool>{"True", true}, {"False", false}})
      if (text_.compare(at_, word.size(), word) == 0) return at_ += word.size(), value;
    fail("True or False");
  }

  void parse() {
    bool hasType = false, hasOrder = false, hasShape = false;
    need('{');
    while (!take('}')) {
      const std::string key = text();
      need(':');
      if (key == "descr" && !hasType)
        type(), hasType = true;
      else if (key == "fortran_order" && !hasOrder)
        fortranOrder = truth(), hasOrder = true;
      else if (key == "shape" && !hasShape)
        shape = tuple(), hasShape = true;
      else
        fail("descr, fortran_order and shape, once each");
      if (!take(',')) {
        need('}');
        break;
      }
    }
    if (!hasType || !hasOrder || !hasShape) fail("all of descr, fortran_order and shape");
  }

  const std::string& path_;
  std::string text_;
  std::size_t at_ = 0;
};

/// What a type such as "<f4" says.
struct Number {
  std::optional<NumberType> type;  ///< none: bytes that stand for nothing ("|V4")
  std::size_t bytes = 0;
  bool bigEndian = false;
};

std::optional<NumberType> typeOf(char kind, std::size_t size) {
  constexpr struct {
    char kind;
    std::size_t size;
    NumberType type;
  } kTypes[] = {{'i', 1, NumberType::I8},  {'i', 2, NumberType::I16}, {'i', 4, NumberType::I32},
                {'i', 8, NumberType::I64}, {'u', 1, NumberType::U8},  {'u', 2, NumberType::U16},
                {'u', 4, NumberType::U32}, {'u', 8, NumberType::U64}, {'b', 1, NumberType::U8},
                {'f', 2, NumberType::F16}, {'f', 4, NumberType::F32}, {'f', 8, NumberType::F64}};
  for (const auto& t : kTypes)
    if (t.kind == kind && t.size == size) return t.type;
  return std::nullopt;
}

Number numberOf(const std::string& path, const Field& field) {
  const std::string what = field.name.empty() ? "descr" : fmt::format("descr, field '{}'", field.name);
  const auto refuse = [&] {
    throw InputError(path, what, "integers of 8 to 64 bits, floats of 16, 32 or 64, or bools",
                     fmt::format("'{}'", field.type), "objects, text, complex numbers and dates are no particles");
  };
  const std::string& t = field.type;
  const bool ordered = !t.empty() && std::strchr("<>=|", t[0]) != nullptr;
  const std::size_t kind = ordered ? 1 : 0;
  if (t.size() < kind + 2 || t.size() > kind + 8) refuse();
  std::size_t size = 0;
  for (std::size_t k = kind + 1; k < t.size(); ++k) {
    if (std::isdigit(static_cast<unsigned char>(t[k])) == 0) refuse();
    size = size * 10 + static_cast<std::size_t>(t[k] - '0');
  }
  if (t[kind] == 'V') return {std::nullopt, size, false};
  const std::optional<NumberType> type = typeOf(t[kind], size);
  if (!type) refuse();
  return {type, size, t[0] == '>' && size > 1};
}

std::uint64_t product(const std::string& path, std::span<const std::uint64_t> shape, std::uint64_t most) {
  std::uint64_t all = 1;
  for (const std::uint64_t n : shape) {
    if (n != 0 && all > most / n)
      throw InputError(path, "shape", fmt::format("at most {} numbers a particle", most), "more");
    all *= n;
  }
  return all;
}

}  // namespace

/// The row of a table.
struct NpyReader::Dtype {
  std::vector<PlacedChannel> columns;
  std::size_t bytes = 0;
  bool bigEndian = false;
};

bool beginsAsNpy(std::span<const std::byte> start) {
  return start.size() >= sizeof kMagic && std::memcmp(start.data(), kMagic, sizeof kMagic) == 0;
}

NpyReader::NpyReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  Section section(file_, 0, file_.bytes());
  const std::string start = section.bytes(8, "NPY magic number and version");
  if (std::memcmp(start.data(), kMagic, sizeof kMagic) != 0)
    throw InputError(path_, "NPY magic number", "\\x93NUMPY", "something else");
  const int major = static_cast<unsigned char>(start[6]);
  if (major < 1 || major > 3)
    throw InputError(path_, "NPY version", "1.0, 2.0 or 3.0", fmt::format("{}.{}", major, start[7] & 0xff));
  const std::string lengthBytes = section.bytes(major == 1 ? 2 : 4, "NPY header length");
  std::uint64_t length = 0;
  for (std::size_t k = 0; k < lengthBytes.size(); ++k)
    length |= std::uint64_t{static_cast<unsigned char>(lengthBytes[k])} << (8 * k);
  if (length > kMostHeader || length > file_.bytes())
    throw InputError(path_, "NPY header length", fmt::format("at most {} bytes", std::min(kMostHeader, file_.bytes())),
                     fmt::format("{}", length), "the file is cut off or damaged");
  const Header header(path_, section.bytes(length, "NPY header"));
  format_ = fmt::format("NPY {}.{}", major, start[7] & 0xff);
  dataBegin_ = section.position();

  Dtype dtype;
  for (const Field& field : header.fields) {
    const Number number = numberOf(path_, field);
    const std::uint64_t arity = product(path_, field.shape, kMostRowBytes);
    if (number.type && arity > 0) {
      if (!dtype.columns.empty() && number.bytes > 1 && number.bigEndian != dtype.bigEndian)
        throw InputError(path_, fmt::format("descr, field '{}'", field.name), "one byte order in all fields",
                         fmt::format("'{}'", field.type));
      if (number.bytes > 1) dtype.bigEndian = number.bigEndian;
      dtype.columns.emplace_back(field.name, *number.type, static_cast<std::uint32_t>(arity), dtype.bytes);
    }
    if (arity * number.bytes > kMostRowBytes - dtype.bytes)
      throw InputError(path_, "descr", fmt::format("at most {} bytes a particle", kMostRowBytes), "more");
    dtype.bytes += arity * number.bytes;
  }
  byColumns_ = header.fortranOrder && header.shape.size() > 1;
  if (header.structured && header.shape.size() != 1)
    throw InputError(path_, "shape", "one number, as fields say what a particle has",
                     fmt::format("{} numbers", header.shape.size()));
  setChannels(dtype, header.shape);
}

void NpyReader::setChannels(const Dtype& dtype, std::span<const std::uint64_t> shape) {
  bigEndian_ = dtype.bigEndian, rowBytes_ = dtype.bytes;
  if (shape.empty() || dtype.columns.empty() || rowBytes_ == 0)
    throw InputError(path_, shape.empty() ? "shape" : "descr", "an array of particles", "nothing that holds any");
  count_ = shape[0];
  const bool plain = dtype.columns[0].channel.name.empty();
  if (!plain) {
    placed_ = withVectors(dtype.columns);
  } else {
    const std::uint64_t width = product(path_, shape.subspan(1), kMostRowBytes / rowBytes_);
    if (shape.size() > 2)
      throw InputError(path_, "shape", "(N, columns), or an array with fields",
                       fmt::format("{} numbers", shape.size()));
    placed_ = plainColumns(path_, width, dtype.columns[0].channel.type);
    rowBytes_ *= width;
  }
  for (const PlacedChannel& placed : placed_) {
    if (channel(placed.channel.name))
      throw InputError(path_, "descr", "fields of different names", fmt::format("'{}' twice", placed.channel.name));
    channels_.push_back(placed.channel);
  }
  const std::uint64_t left = file_.bytes() - dataBegin_;
  if (count_ > left / rowBytes_)
    throw InputError(path_, "shape",
                     fmt::format("at most {} particles of {} bytes, as {} bytes follow the header", left / rowBytes_,
                                 rowBytes_, left),
                     fmt::format("{}", count_), "the file is cut off");
  if (left > count_ * rowBytes_)
    logWarning(fmt::format("{}: ignored {} bytes behind the last of its {} particles", path_, left - count_ * rowBytes_,
                           count_));
}

void NpyReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / rowBytes_);
  std::vector<std::byte> rows(perBlock * rowBytes_), column;
  const auto fill = [&](std::byte* to, std::uint64_t from, std::size_t bytes) {
    file_.seek(from);
    if (file_.read(to, bytes) != bytes)
      throw InputError(path_, "particle data", fmt::format("{} bytes at byte {}", bytes, from), "the file's end",
                       "it became shorter while it was read");
  };
  try {
    for (ChannelSink& sink : sinks) sink.reserve(count_);
    for (std::uint64_t first = 0; first < count_; first += perBlock) {
      const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count_ - first));
      if (!byColumns_) {
        fill(rows.data(), dataBegin_ + first * rowBytes_, here * rowBytes_);
      } else {
        const std::size_t size = numberSize(channels_[0].type);
        column.resize(here * size);
        for (std::size_t c = 0; c < rowBytes_ / size; ++c) {
          fill(column.data(), dataBegin_ + (c * count_ + first) * size, column.size());
          for (std::size_t i = 0; i < here; ++i) std::memcpy(&rows[i * rowBytes_ + c * size], &column[i * size], size);
        }
      }
      for (ChannelSink& sink : sinks)
        sink.append(rows.data() + placed_[sink.index()].offset, rowBytes_, here, bigEndian_);
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles of {} bytes", path_, count_, rowBytes_));
  }
}

}  // namespace mote
