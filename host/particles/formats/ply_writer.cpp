#include "host/particles/formats/ply_writer.h"

#include <fmt/format.h>

#include <limits>
#include <set>

#include "host/core/error.h"
#include "host/particles/formats/number_text.h"

namespace mote {
namespace {

std::string_view typeOf(NumberType type) {
  switch (type) {
    case NumberType::I8: return "char";
    case NumberType::U8: return "uchar";
    case NumberType::I16: return "short";
    case NumberType::U16: return "ushort";
    case NumberType::I32: return "int";
    case NumberType::U32: return "uint";
    case NumberType::F64: return "double";
    default: return "float";
  }
}

/// The names of a channel's numbers.
std::vector<std::string> propertyNames(const Channel& c) {
  if (c.arity == 1) return {c.name};
  if (c.arity == 3 && c.name == "Position") return {"x", "y", "z"};
  if (c.arity == 3 && c.name == "Velocity") return {"vx", "vy", "vz"};
  if (c.arity == 3 && c.name == "Normal") return {"nx", "ny", "nz"};
  if (c.arity == 3 && c.name == "Color") return {"red", "green", "blue"};
  if (c.arity == 3) return {c.name + "_x", c.name + "_y", c.name + "_z"};
  std::vector<std::string> names;
  for (std::uint32_t k = 0; k < c.arity; ++k) names.push_back(fmt::format("{}[{}]", c.name, k));
  return names;
}

/// What a reader takes integers of a colour for.
double shareOf(NumberType type) {
  return type == NumberType::U8 ? 1.0 / 255 : type == NumberType::U16 ? 1.0 / 65535 : 1;
}

constexpr std::size_t kMostDigits = std::numeric_limits<std::uint64_t>::digits10 + 1;

}  // namespace

Channel plyChannel(const Channel& channel) {
  Channel stored = channel;
  for (char& c : stored.name)
    if ((c >= 0 && c <= 32) || c == 127) c = '_';
  const bool color = stored.name == "Color" && stored.arity == 3;
  if (stored.scale != (color ? shareOf(stored.type) : 1)) stored.type = NumberType::F32, stored.scale = 1;
  if (stored.type == NumberType::F16) stored.type = NumberType::F32;
  if (stored.type == NumberType::I64 || stored.type == NumberType::U64) stored.type = NumberType::F64;
  return stored;
}

PlyWriter::PlyWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>&,
                     const WriteOptions& options)
    : ParticleWriter(path, std::move(channels)), text_(options.text) {
  std::set<std::string> names;
  for (const Channel& c : channels_)
    for (const std::string& name : propertyNames(c)) {
      if (!names.insert(name).second)
        throw InputError(path, fmt::format("channel '{}'", c.name), "properties of different names",
                         fmt::format("'{}' twice", name), "rename one: --channels NEW=OLD,…");
      properties_.push_back(fmt::format("property {} {}", typeOf(c.type), name));
    }
  out_.write(header(std::numeric_limits<std::uint64_t>::max()));
}

/// Of the same length for any count: a comment takes what its digits leave.
std::string PlyWriter::header(std::uint64_t count) const {
  const std::string number = std::to_string(count);
  std::string text = fmt::format("ply\nformat {} 1.0\ncomment Mote {}{}\nelement vertex {}\n",
                                 text_ ? "ascii" : "binary_little_endian", MOTE_VERSION,
                                 std::string(kMostDigits - number.size(), ' '), number);
  for (const std::string& property : properties_) text += property + "\n";
  return text + "end_header\n";
}

void PlyWriter::writeRows(std::span<const std::byte> rows, std::size_t) {
  if (!text_) return out_.write(rows);
  for (const std::string& text : rowsAsText(rows, rowBytes_, channels_, ' ')) out_.write(text);
}

void PlyWriter::complete() { out_.replace(0, header(count_)); }

}  // namespace mote
