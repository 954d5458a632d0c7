#include "host/particles/formats/npy_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "host/core/error.h"

namespace mote {
namespace {

/// "<f4"; a byte has no order.
std::string typeOf(NumberType type) {
  const std::string_view name = numberName(type);
  const std::size_t size = numberSize(type);
  return fmt::format("{}{}{}", size == 1 ? '|' : '<', name[0], size);  // int16, uint8 and float32 begin as numpy's do
}

/// As a Python text in quotes.
std::string quoted(std::string_view name) {
  std::string text = "'";
  for (const char c : name) {
    if (c == '\'' || c == '\\') text += '\\';
    text += c;
  }
  return text + "'";
}

/// numpy aligns the data to this, for maps of the file.
constexpr std::size_t kAlignment = 64;
constexpr std::size_t kMostDigits = std::numeric_limits<std::uint64_t>::digits10 + 1;

}  // namespace

Channel npyChannel(const Channel& channel) {
  Channel stored = channel.scale == 1 ? channel : Channel{channel.name, NumberType::F32, channel.arity};
  for (char& c : stored.name)
    if ((c >= 0 && c < 32) || c == 127) c = '_';  // Python would read a line's end in a text as an error
  return stored;
}

NpyWriter::NpyWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>&,
                     const WriteOptions&)
    : ParticleWriter(path, std::move(channels)) {
  out_.write(header(std::numeric_limits<std::uint64_t>::max()));
}

/// Of the same length for any count.
std::string NpyWriter::header(std::uint64_t count) const {
  std::string fields;
  bool ascii = true;
  for (const Channel& c : channels_) {
    const std::string shape = c.arity == 1 ? "" : fmt::format(", ({},)", c.arity);
    fields += fmt::format("({}, '{}'{}), ", quoted(c.name), typeOf(c.type), shape);
    ascii = ascii && std::all_of(c.name.begin(), c.name.end(), [](char one) { return one >= 0; });
  }
  const std::string number = std::to_string(count);
  std::string dictionary = fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields, number);
  dictionary.append(kMostDigits - number.size(), ' ');
  const std::size_t longest = dictionary.size() + kAlignment;
  const int version = !ascii ? 3 : longest > std::numeric_limits<std::uint16_t>::max() ? 2 : 1;
  const std::size_t start = version == 1 ? 10 : 12;
  dictionary.append(kAlignment - (start + dictionary.size() + 1) % kAlignment, ' ');
  dictionary += '\n';
  std::string out("\x93NUMPY", 6);
  out += static_cast<char>(version), out += '\0';
  for (std::size_t k = 0; k < start - 8; ++k) out += static_cast<char>(dictionary.size() >> (8 * k) & 0xff);
  return out + dictionary;
}

void NpyWriter::writeRows(std::span<const std::byte> rows, std::size_t) { out_.write(rows); }

void NpyWriter::complete() { out_.replace(0, header(count_)); }

}  // namespace mote
