// Particles that a test writes with the writers and looks at again.
#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "host/core/random.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/particle_writer.h"
#include "tests/support/temp_folder.h"

namespace mote::test {

/// A channel and its raw numbers.
struct RawChannel {
  Channel channel;
  std::vector<std::byte> bytes;
};

template <class T>
RawChannel rawChannel(std::string name, NumberType type, std::uint32_t arity, const std::vector<T>& numbers) {
  RawChannel raw{{std::move(name), type, arity}, std::vector<std::byte>(numbers.size() * sizeof(T))};
  std::memcpy(raw.bytes.data(), numbers.data(), raw.bytes.size());
  return raw;
}

/// Any bits of the type, but of floats those of finite numbers and infinities: a text keeps no NaN's payload.
inline RawChannel anyNumbers(std::string name, NumberType type, std::uint32_t arity, std::size_t count) {
  RawChannel raw{{std::move(name), type, arity}, std::vector<std::byte>(count * arity * numberSize(type))};
  const std::size_t size = numberSize(type);
  for (std::size_t i = 0; i < count * arity; ++i) {
    std::uint64_t bits = hashBits(1, i, size);
    const bool infinite = type == NumberType::F16   ? (bits & 0x7c00) == 0x7c00
                          : type == NumberType::F32 ? (bits & 0x7f800000) == 0x7f800000
                          : type == NumberType::F64 ? (bits & 0x7ff0000000000000) == 0x7ff0000000000000
                                                    : false;
    if (infinite) bits = type == NumberType::F16 ? 0x7c00 : type == NumberType::F32 ? 0x7f800000 : 0x7ff0000000000000;
    if (i == 0) bits = 0;
    if (i == 1) bits = ~std::uint64_t{0} >> 1;  // the greatest integer; the floats' NaN
    if (i == 1 && (type == NumberType::F16 || type == NumberType::F32 || type == NumberType::F64))
      bits = 1;                                             // denormal
    if (i == 2) bits = std::uint64_t{1} << (8 * size - 1);  // the least integer; −0
    std::memcpy(&raw.bytes[i * size], &bits, size);
  }
  return raw;
}

/// Writes channels as they are; in blocks of `perBlock` particles, 0: in one.
inline void writeRaw(OutputFormat format, const std::string& path, const std::vector<RawChannel>& channels,
                     const WriteOptions& options = {}, const std::vector<Metadata>& metadata = {},
                     std::size_t perBlock = 0) {
  std::vector<Channel> list;
  for (const RawChannel& raw : channels) list.push_back(raw.channel);
  const auto writer = createParticleFile(format, path, list, metadata, options);
  const std::size_t count = channels[0].bytes.size() / channels[0].channel.bytes();
  const std::size_t step = perBlock == 0 ? std::max<std::size_t>(count, 1) : perBlock;
  for (std::size_t first = 0; first < count; first += step) {
    std::vector<std::span<const std::byte>> columns;
    for (const RawChannel& raw : channels)
      columns.push_back(std::span(raw.bytes).subspan(first * raw.channel.bytes(),
                                                     std::min(step, count - first) * raw.channel.bytes()));
    writer->write(columns);
  }
  EXPECT_EQ(writer->count(), count);
  writer->finish();
}

inline std::vector<std::byte> readRaw(const ParticleFile& file, const std::string& channel) {
  std::vector<std::byte> bytes;
  const ChannelRequest request{channel, &bytes};
  file.read({&request, 1});
  return bytes;
}

template <class T>
std::vector<T> readNumbers(const ParticleFile& file, const std::string& channel) {
  std::vector<T> values;
  const ChannelRequest request{channel, &values};
  file.read({&request, 1});
  return values;
}

/// The file has exactly these channels, to the last bit.
inline void expectChannels(const ParticleFile& file, const std::vector<RawChannel>& channels) {
  std::vector<Channel> list;
  for (const RawChannel& raw : channels) list.push_back(raw.channel);
  ASSERT_EQ(describeChannels(file.channels()), describeChannels(list)) << file.format();
  for (const RawChannel& raw : channels) {
    ASSERT_EQ(file.channel(raw.channel.name)->scale, raw.channel.scale) << raw.channel.name;
    EXPECT_EQ(file.count(), raw.bytes.size() / raw.channel.bytes());
    EXPECT_TRUE(readRaw(file, raw.channel.name) == raw.bytes)
        << file.format() << ": " << raw.channel.name << ", " << raw.channel.arity << " × "
        << numberName(raw.channel.type);
  }
}

constexpr NumberType kAllTypes[] = {NumberType::I8,  NumberType::U8,  NumberType::I16, NumberType::U16,
                                    NumberType::I32, NumberType::U32, NumberType::I64, NumberType::U64,
                                    NumberType::F16, NumberType::F32, NumberType::F64};

}  // namespace mote::test
