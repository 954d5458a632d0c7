// PRT files put together byte by byte, so that reader and writer are not only held against each other.
#pragma once
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "host/core/log.h"
#include "host/particles/formats/prt_reader.h"
#include "tests/support/refusal.h"
#include "tests/support/temp_folder.h"

namespace mote::test {

template <class T>
std::string raw(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

inline std::string zeroTerminated(const std::string& text) { return text + '\0'; }

inline std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  EXPECT_EQ(compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                      bytes.size(), 6),
            Z_OK);
  out.resize(size);
  return out;
}

inline std::string chunk(const std::string& kind, const std::string& data) {
  return kind + raw(static_cast<std::int32_t>(data.size())) + data;
}

inline std::string meta(const std::string& channel, const std::string& name, std::int32_t type,
                        const std::string& value) {
  return chunk("Meta", zeroTerminated(channel) + zeroTerminated(name) + raw(type) + value);
}

struct ChannelRecord {
  std::string name;
  std::int32_t type, arity, offset;
};

/// A PRT file whose every field a test may spoil.
struct PrtFile {
  std::string magic = std::string("\xC0PRT\r\n\x1a\n", 8);
  std::string signature = "Extensible Particle Format";
  std::int32_t version = 2;
  std::int64_t count = 3;
  std::string chunks = meta("", "LengthUnitInMeters", 5, raw(0.01)) + chunk("Stop", "");
  std::int32_t headerLengthChange = 0;
  std::int32_t reserved = 4, recordLength = 44;
  std::optional<std::int32_t> channelCount;
  std::vector<ChannelRecord> channels{{"Position", 4, 3, 0}, {"Density", 4, 1, 12}};
  std::string particles;            ///< not compressed
  std::optional<std::string> body;  ///< instead of the compressed particles

  PrtFile() {
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < 4; ++c) particles += raw(static_cast<float>(i + 0.25 * c));
  }
  std::string header() const {
    const std::string shown = version == 2 ? chunks : "";
    std::string out = magic + raw(static_cast<std::int32_t>(56 + static_cast<int>(shown.size()) + headerLengthChange));
    out += signature + std::string(32 - signature.size(), '\0') + raw(version) + raw(count) + shown;
    out += raw(reserved) + raw(channelCount.value_or(static_cast<std::int32_t>(channels.size()))) + raw(recordLength);
    for (const ChannelRecord& c : channels) {
      out += c.name + std::string(32 - c.name.size(), '\0') + raw(c.type) + raw(c.arity) + raw(c.offset);
      if (recordLength > 44) out += std::string(static_cast<std::size_t>(recordLength) - 44, 'x');
    }
    return out;
  }
  std::string bytes() const { return header() + body.value_or(deflated(particles)); }
};

/// Opens and reads Position of `bytes` as a file.
inline std::vector<vec3> positionsOf(const std::string& bytes) {
  const TempFolder folder;
  writeBytes(folder.file("a.prt"), bytes);
  const PrtReader reader(folder.file("a.prt"));
  std::vector<vec3> positions;
  const ChannelRequest request{"Position", &positions};
  reader.read({&request, 1});
  return positions;
}

inline void expectRefused(const PrtFile& file, const std::vector<std::string>& words) {
  expectRefused([&] { positionsOf(file.bytes()); }, words);
}

inline bool warned(const std::string& word) {
  for (const std::string& line : takeWarnings())
    if (line.find(word) != std::string::npos) return true;
  return false;
}

}  // namespace mote::test
