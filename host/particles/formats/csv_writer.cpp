#include "host/particles/formats/csv_writer.h"

#include <fmt/format.h>

#include "host/particles/formats/number_text.h"

namespace mote {

Channel csvChannel(const Channel& channel) {
  Channel stored = channel.scale == 1 ? channel : Channel{channel.name, NumberType::F32, channel.arity};
  for (char& c : stored.name)
    if (c == ',' || (c >= 0 && c < 32) || c == 127) c = '_';
  // A reader takes blanks at the ends away.
  if (stored.name.front() == ' ') stored.name.front() = '_';
  if (stored.name.back() == ' ') stored.name.back() = '_';
  return stored;
}

CsvWriter::CsvWriter(const std::string& path, std::vector<Channel> channels, const std::vector<Metadata>&,
                     const WriteOptions&)
    : ParticleWriter(path, std::move(channels)) {
  std::string header;
  for (const Channel& c : channels_)
    for (std::uint32_t k = 0; k < c.arity; ++k) header += fmt::format("{} {},", numberName(c.type), c.name);
  header.back() = '\n';
  out_.write(header);
}

void CsvWriter::writeRows(std::span<const std::byte> rows, std::size_t) {
  for (const std::string& text : rowsAsText(rows, rowBytes_, channels_, ',')) out_.write(text);
}

}  // namespace mote
