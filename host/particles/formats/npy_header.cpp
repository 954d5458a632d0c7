#include "host/particles/formats/npy_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <string_view>

#include "host/core/error.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

/// No writer comes near; it keeps what is read in front of the data small.
constexpr std::uint64_t kMostHeader = 1 << 20;
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

/// Throws where a type is none at all; gives no bytes where it stands for something else than numbers.
std::optional<Number> numberOf(const std::string& path, const Field& field) {
  const std::string& t = field.type;
  const bool ordered = !t.empty() && std::strchr("<>=|", t[0]) != nullptr;
  const std::size_t kind = ordered ? 1 : 0;
  std::size_t size = 0;
  for (std::size_t k = kind + 1; k < t.size(); ++k) {
    if (std::isdigit(static_cast<unsigned char>(t[k])) == 0 || t.size() > kind + 8) return std::nullopt;
    size = size * 10 + static_cast<std::size_t>(t[k] - '0');
  }
  if (t.size() <= kind) throw InputError(path, "descr", "a type like '<f4'", fmt::format("'{}'", t));
  if (t[kind] == 'V' && t.size() > kind + 1) return Number{std::nullopt, size, false};
  const std::optional<NumberType> type = typeOf(t[kind], size);
  if (!type) return std::nullopt;
  return Number{type, size, t[0] == '>' && size > 1};
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

std::uint64_t headerLength(const std::string& place, const std::string& raw, std::uint64_t size) {
  std::uint64_t length = 0;
  for (std::size_t k = 0; k < raw.size(); ++k) length |= std::uint64_t{static_cast<unsigned char>(raw[k])} << (8 * k);
  if (length > kMostHeader || length > size)
    throw InputError(place, "NPY header length", fmt::format("at most {} bytes", std::min(kMostHeader, size)),
                     fmt::format("{}", length), "the file is cut off or damaged");
  return length;
}

void addField(const std::string& place, const Field& field, NpyArray& array) {
  const std::optional<Number> number = numberOf(place, field);
  if (!number) {
    if (array.notNumbers.empty()) array.notNumbers = field.type, array.notNumbersField = field.name;
    return;
  }
  const std::uint64_t arity = product(place, field.shape, kMostNpyRow);
  if (number->type && arity > 0) {
    if (!array.fields.empty() && number->bytes > 1 && number->bigEndian != array.bigEndian)
      throw InputError(place, fmt::format("descr, field '{}'", field.name), "one byte order in all fields",
                       fmt::format("'{}'", field.type));
    if (number->bytes > 1) array.bigEndian = number->bigEndian;
    array.fields.emplace_back(field.name, *number->type, static_cast<std::uint32_t>(arity), array.elementBytes);
  }
  if (arity * number->bytes > kMostNpyRow - array.elementBytes)
    throw InputError(place, "descr", fmt::format("at most {} bytes a particle", kMostNpyRow), "more");
  array.elementBytes += arity * number->bytes;
}

}  // namespace

NpyArray readNpyHeader(const std::string& place, const NpyBytes& bytes, std::uint64_t size) {
  const std::string start = bytes(8, "NPY magic number and version");
  if (std::memcmp(start.data(), kNpyMagic, sizeof kNpyMagic) != 0)
    throw InputError(place, "NPY magic number", "\\x93NUMPY", "something else");
  NpyArray array;
  const int major = static_cast<unsigned char>(start[6]), minor = static_cast<unsigned char>(start[7]);
  array.version = fmt::format("{}.{}", major, minor);
  if (major < 1 || major > 3) throw InputError(place, "NPY version", "1.0, 2.0 or 3.0", array.version);
  const std::string lengthBytes = bytes(major == 1 ? 2 : 4, "NPY header length");
  const std::uint64_t length = headerLength(place, lengthBytes, size);
  Header header(place, bytes(length, "NPY header"));
  array.dataBegin = start.size() + lengthBytes.size() + length;
  array.shape = std::move(header.shape);
  requireFewChannels(place, header.fields.size());
  array.structured = header.structured, array.fortranOrder = header.fortranOrder;
  for (const Field& field : header.fields) addField(place, field, array);
  return array;
}

void requireNumbers(const std::string& place, const NpyArray& array) {
  if (array.notNumbers.empty()) return;
  throw InputError(place,
                   array.notNumbersField.empty() ? "descr" : fmt::format("descr, field '{}'", array.notNumbersField),
                   "integers of 8 to 64 bits, floats of 16, 32 or 64, or bools", fmt::format("'{}'", array.notNumbers),
                   "objects, text, complex numbers and dates are no particles");
}

std::uint64_t numbersOfRow(const std::string& place, const NpyArray& array) {
  return product(place, std::span(array.shape).subspan(1), kMostNpyRow / std::max<std::size_t>(1, array.elementBytes));
}

NpyTable npyTable(const std::string& place, const NpyArray& array) {
  requireNumbers(place, array);
  if (array.structured && array.shape.size() != 1)
    throw InputError(place, "shape", "one number, as fields say what a particle has",
                     fmt::format("{} numbers", array.shape.size()));
  if (array.shape.empty() || array.fields.empty() || array.elementBytes == 0)
    throw InputError(place, array.shape.empty() ? "shape" : "descr", "an array of particles", "nothing that holds any");
  NpyTable table{array.shape[0], array.elementBytes, {}, array.bigEndian, false};
  if (array.structured) {
    table.channels = withVectors(array.fields);
    std::set<std::string_view> names;
    for (const PlacedChannel& placed : table.channels)
      if (!names.insert(placed.channel.name).second)
        throw InputError(place, "descr", "fields of different names", fmt::format("'{}' twice", placed.channel.name));
    return table;
  }
  const std::uint64_t width = numbersOfRow(place, array);
  if (array.shape.size() > 2)
    throw InputError(place, "shape", "(N, columns), or an array with fields",
                     fmt::format("{} numbers", array.shape.size()));
  table.channels = plainColumns(place, width, array.fields[0].channel.type);
  table.rowBytes *= width;
  table.byColumns = array.fortranOrder && array.shape.size() > 1;
  return table;
}

NpyRows::NpyRows(const NpyTable& table, NpyFill fill, std::size_t longestRow)
    : table_(table),
      fill_(std::move(fill)),
      perBlock_(std::max<std::size_t>(1, kBlockBytes / std::max(table.rowBytes, longestRow))),
      rows_(std::min<std::uint64_t>(perBlock_, table.count) * table.rowBytes) {}

std::byte* NpyRows::read(std::uint64_t first, std::size_t count) {
  const std::size_t rowBytes = table_.rowBytes;
  if (!table_.byColumns) {
    fill_(rows_.data(), first * rowBytes, count * rowBytes);
    return rows_.data();
  }
  const std::size_t size = numberSize(table_.channels[0].channel.type);
  column_.resize(count * size);
  for (std::size_t c = 0; c < rowBytes / size; ++c) {
    fill_(column_.data(), (c * table_.count + first) * size, column_.size());
    for (std::size_t i = 0; i < count; ++i) std::memcpy(&rows_[i * rowBytes + c * size], &column_[i * size], size);
  }
  return rows_.data();
}

}  // namespace mote
