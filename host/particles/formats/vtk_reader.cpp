#include "host/particles/formats/vtk_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <new>
#include <optional>

#include "host/core/error.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/section.h"
#include "host/particles/formats/text_number.h"

namespace mote {
namespace {

constexpr char kMagic[] = "# vtk DataFile Version ";
constexpr std::size_t kMostWord = 256, kMostLine = 1024;
constexpr std::uint64_t kMostArity = 1 << 16;
constexpr std::size_t kBlockBytes = 1 << 19;

struct TypeName {
  const char* name;
  std::optional<NumberType> type;  ///< none: it is stepped over
};
// vtkIdType is written as an int (vtkDataWriter), long has eight bytes.
constexpr TypeName kTypes[] = {
    {"char", NumberType::I8},          {"signed_char", NumberType::I8},     {"unsigned_char", NumberType::U8},
    {"short", NumberType::I16},        {"unsigned_short", NumberType::U16}, {"int", NumberType::I32},
    {"unsigned_int", NumberType::U32}, {"long", NumberType::I64},           {"unsigned_long", NumberType::U64},
    {"vtktypeint64", NumberType::I64}, {"vtktypeuint64", NumberType::U64},  {"vtkIdType", NumberType::I32},
    {"vtkidtype", NumberType::I32},    {"float", NumberType::F32},          {"double", NumberType::F64}};

std::optional<NumberType> typeNamed(const std::string& name) {
  for (const TypeName& t : kTypes)
    if (name == t.name) return t.type;
  return std::nullopt;
}

/// %20 and the like, as VTK has what would part a name.
std::string decoded(const std::string& name) {
  std::string text;
  for (std::size_t k = 0; k < name.size(); ++k) {
    unsigned code = 0;
    if (name[k] == '%' && k + 2 < name.size() &&
        std::from_chars(&name[k + 1], &name[k + 1] + 2, code, 16).ptr == &name[k + 1] + 2)
      text += static_cast<char>(code), k += 2;
    else
      text += name[k];
  }
  return text;
}

/// Behind its keyword: up to an empty line.
void skipMetadata(ByteStream& bytes) {
  bytes.line(kMostLine);
  while (!bytes.line(kMostLine).empty()) continue;
}

}  // namespace

bool beginsAsVtk(std::span<const std::byte> start) {
  return start.size() >= sizeof kMagic - 1 && std::memcmp(start.data(), kMagic, sizeof kMagic - 1) == 0;
}

VtkReader::VtkReader(std::string path) : ParticleFile(path), file_(std::move(path)) { parse(); }

void VtkReader::fail(const ByteStream& bytes, const std::string& expected, const std::string& got) const {
  throw InputError(path_, fmt::format("VTK, at byte {}", bytes.position()), expected,
                   got.empty() ? "the file's end" : shown(got), got.empty() ? "the file is cut off" : "");
}

std::uint64_t VtkReader::number(ByteStream& bytes, const char* what) const {
  const std::string word = bytes.word(kMostWord);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc() || end != word.data() + word.size()) fail(bytes, what, word);
  return value;
}

std::uint64_t VtkReader::skip(ByteStream& bytes, const std::string& type, std::uint64_t count) const {
  bytes.line(kMostLine);
  const std::uint64_t begin = bytes.position(), left = file_.bytes() - std::min(file_.bytes(), begin);
  if (type == "string") fail(bytes, "arrays of numbers", "string");
  if (!binary_) {
    if (count > left) fail(bytes, fmt::format("{} numbers", count), "");
    for (std::uint64_t k = 0; k < count; ++k)
      if (bytes.word(kMostWord).empty()) fail(bytes, fmt::format("{} numbers", count), "");
    return begin;
  }
  const std::optional<NumberType> known = typeNamed(type);
  if (!known && type != "bit") fail(bytes, "a type like float or unsigned_int", type);
  const std::uint64_t size = known ? numberSize(*known) : 1, numbers = known ? count : count / 8 + (count % 8 != 0);
  if (numbers > left / size) fail(bytes, fmt::format("{} numbers of type {}", count, type), "");
  bytes.seek(begin + numbers * size);
  return begin;
}

void VtkReader::keep(ByteStream& bytes, std::string name, const std::string& type, std::uint64_t arity, bool ofPoints,
                     std::uint64_t tuples) {
  if (arity == 0 || arity > kMostArity)
    fail(bytes, fmt::format("1 to {} numbers each", kMostArity), std::to_string(arity));
  if (tuples > std::numeric_limits<std::uint64_t>::max() / arity) fail(bytes, "fewer", std::to_string(tuples));
  const std::uint64_t begin = skip(bytes, type, tuples * arity);
  const std::optional<NumberType> known = typeNamed(type);
  if (!known && type != "bit") fail(bytes, "a type like float or unsigned_int", type);
  if (!ofPoints || !known) return;
  if (tuples != count_) fail(bytes, fmt::format("{} for as many points", count_), std::to_string(tuples));
  if (channel(name)) fail(bytes, "arrays of different names", name);
  requireFewChannels(path_, channels_.size() + 1);
  channels_.push_back({std::move(name), *known, static_cast<std::uint32_t>(arity)});
  begins_.push_back(begin);
}

void VtkReader::parse() {
  ByteStream bytes(file_, 0);
  const std::string first = bytes.line(kMostLine);
  if (!first.starts_with(kMagic)) fail(bytes, kMagic, first);
  const char* version = first.c_str() + sizeof kMagic - 1;
  if (std::from_chars(version, first.c_str() + first.size(), version_).ec != std::errc() || version_ < 1 ||
      version_ > 5)
    fail(bytes, "version 1 to 5", first);
  bytes.line(kMostLine);  // a title
  const std::string encoding = bytes.word(kMostWord);
  if (encoding != "ASCII" && encoding != "BINARY") fail(bytes, "ASCII or BINARY", encoding);
  binary_ = encoding == "BINARY";
  format_ = fmt::format("VTK {} ({})", version_, binary_ ? "binary" : "text");
  bool hasPoints = false, ofPoints = false, ofCells = false;
  std::uint64_t cells = 0;
  for (;;) {
    const std::string key = bytes.word(kMostWord);
    if (key.empty()) break;
    const auto many = [&] { return ofPoints ? count_ : cells; };
    const auto inData = [&] {
      if (!ofPoints && !ofCells) fail(bytes, "POINT_DATA or CELL_DATA before it", key);
    };
    if (key == "DATASET") {
      const std::string kind = bytes.word(kMostWord);
      if (kind != "POLYDATA" && kind != "UNSTRUCTURED_GRID")
        fail(bytes, "POLYDATA or UNSTRUCTURED_GRID, as others have no particles", kind);
    } else if (key == "POINTS") {
      if (hasPoints) fail(bytes, "POINTS once", key);
      count_ = number(bytes, "the number of points");
      const std::string type = bytes.word(kMostWord);
      hasPoints = true;
      if (!typeNamed(type)) fail(bytes, "a type like float or double", type);
      keep(bytes, "Position", type, 3, true, count_);
    } else if (key == "VERTICES" || key == "LINES" || key == "POLYGONS" || key == "TRIANGLE_STRIPS" || key == "CELLS") {
      const std::uint64_t count = number(bytes, "the number of cells"), size = number(bytes, "a list's size");
      if (version_ < 5) {
        skip(bytes, "int", size);
      } else {
        for (const auto& [name, length] : {std::pair{"OFFSETS", count}, std::pair{"CONNECTIVITY", size}}) {
          if (const std::string word = bytes.word(kMostWord); word != name) fail(bytes, name, word);
          const std::string type = bytes.word(kMostWord);
          skip(bytes, type, length);
        }
      }
    } else if (key == "CELL_TYPES") {
      const std::uint64_t count = number(bytes, "the number of cells");
      skip(bytes, "int", count);
    } else if (key == "POINT_DATA" || key == "CELL_DATA") {
      const std::uint64_t count = number(bytes, "a number");
      ofPoints = key == "POINT_DATA", ofCells = !ofPoints;
      if (ofCells) cells = count;
      if (ofPoints && (!hasPoints || count != count_))
        fail(bytes, fmt::format("POINT_DATA {}", count_), std::to_string(count));
    } else if (key == "SCALARS") {
      inData();
      const std::string name = decoded(bytes.word(kMostWord)), type = bytes.word(kMostWord);
      std::uint64_t arity = 1;
      while (bytes.peek() == ' ' || bytes.peek() == '\t') bytes.next();
      if (bytes.peek() >= '0' && bytes.peek() <= '9') arity = number(bytes, "numbers each");
      const std::uint64_t before = bytes.position();
      if (bytes.word(kMostWord) == "LOOKUP_TABLE")
        bytes.word(kMostWord);
      else
        bytes.seek(before);
      keep(bytes, name, type, arity, ofPoints, many());
    } else if (key == "VECTORS" || key == "NORMALS" || key == "TENSORS") {
      inData();
      const std::string name = decoded(bytes.word(kMostWord)), type = bytes.word(kMostWord);
      keep(bytes, name, type, key == "TENSORS" ? 9 : 3, ofPoints && key != "TENSORS", many());
    } else if (key == "TEXTURE_COORDINATES") {
      inData();
      const std::string name = decoded(bytes.word(kMostWord));
      const std::uint64_t arity = number(bytes, "numbers each");
      const std::string type = bytes.word(kMostWord);
      keep(bytes, name, type, arity, ofPoints, many());
    } else if (key == "COLOR_SCALARS") {
      inData();
      const std::string name = decoded(bytes.word(kMostWord));
      const std::uint64_t arity = number(bytes, "numbers each");
      const std::size_t before = channels_.size();
      keep(bytes, name, binary_ ? "unsigned_char" : "float", arity, ofPoints, many());
      if (channels_.size() > before && binary_) channels_.back().scale = 1.0 / 255;
    } else if (key == "LOOKUP_TABLE") {
      bytes.word(kMostWord);
      const std::uint64_t size = number(bytes, "a table's size");
      if (size > file_.bytes()) fail(bytes, "a table within the file", std::to_string(size));
      skip(bytes, binary_ ? "unsigned_char" : "float", 4 * size);
    } else if (key == "FIELD") {
      bytes.word(kMostWord);
      const std::uint64_t arrays = number(bytes, "the number of arrays");
      for (std::uint64_t k = 0; k < arrays; ++k) {
        std::string name = decoded(bytes.word(kMostWord));
        if (name == "METADATA") {  // of the array before
          skipMetadata(bytes);
          name = decoded(bytes.word(kMostWord));
        }
        if (name.empty()) fail(bytes, fmt::format("{} arrays", arrays), "");
        const std::uint64_t arity = number(bytes, "numbers each"), tuples = number(bytes, "how many");
        const std::string type = bytes.word(kMostWord);
        keep(bytes, name, type, arity, ofPoints, tuples);
      }
    } else if (key == "METADATA") {
      skipMetadata(bytes);
    } else {
      fail(bytes, "a keyword like POINTS, POINT_DATA or SCALARS", key);
    }
  }
  if (!hasPoints) fail(bytes, "POINTS", "");
}

void VtkReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<std::byte> rows;
  try {
    for (const ChannelRequest& request : requests) {
      ChannelSink sink(path_, channels_, request);
      sink.reserve(count_);
      const Channel& array = channels_[sink.index()];
      const std::uint64_t begin = begins_[sink.index()];
      const std::size_t size = numberSize(array.type), row = size * array.arity;
      const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / row);
      ByteStream bytes(file_, begin);
      for (std::uint64_t first = 0; first < count_; first += perBlock) {
        const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, count_ - first));
        rows.resize(here * row);
        if (binary_) {
          file_.seek(begin + first * row);
          if (file_.read(rows.data(), rows.size()) != rows.size())
            throw InputError(path_, array.name, fmt::format("{} of them", count_), "the file's end",
                             "it became shorter while it was read");
        } else {
          for (std::size_t i = 0; i < here * array.arity; ++i) {
            const std::string word = bytes.word(kMostWord);
            if (!storeNumberIn(word, array.type, &rows[i * size]))
              throw InputError(path_, fmt::format("{} of point {}", array.name, first + i / array.arity), "a number",
                               "'" + word.substr(0, 40) + "'");
          }
        }
        sink.append(rows.data(), row, here, binary_);
      }
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} points", path_, count_));
  }
}

}  // namespace mote
