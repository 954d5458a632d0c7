#include "host/particles/formats/channel.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "host/core/error.h"

namespace mote {

static_assert(std::endian::native == std::endian::little, "numbers of files are copied as they stand in memory");

namespace {

template <class T>
std::string rawBytes(const T* values, std::size_t count) {
  std::string bytes(sizeof(T) * count, '\0');
  if (count > 0) std::memcpy(bytes.data(), values, bytes.size());
  return bytes;
}

template <class T>
Metadata numbers(std::string channel, std::string name, NumberType type, const T* values, std::size_t count) {
  return {std::move(channel), std::move(name), static_cast<std::int32_t>(type), rawBytes(values, count)};
}

}  // namespace

void requireFewChannels(const std::string& path, std::uint64_t count) {
  if (count > kMostChannels)
    throw InputError(path, "channels", fmt::format("at most {}", kMostChannels), fmt::format("{}", count),
                     "the file is damaged, or holds something else than particles");
}

Metadata Metadata::text(std::string channel, std::string name, std::string text) {
  return {std::move(channel), std::move(name), kMetadataText, std::move(text)};
}
Metadata Metadata::int32(std::string channel, std::string name, std::int32_t value) {
  return numbers(std::move(channel), std::move(name), NumberType::I32, &value, 1);
}
Metadata Metadata::float64(std::string channel, std::string name, double value) {
  return numbers(std::move(channel), std::move(name), NumberType::F64, &value, 1);
}
Metadata Metadata::float64s(std::string channel, std::string name, const std::vector<double>& values) {
  return numbers(std::move(channel), std::move(name), NumberType::F64, values.data(), values.size());
}
Metadata Metadata::float32s(std::string channel, std::string name, const std::vector<float>& values) {
  return numbers(std::move(channel), std::move(name), NumberType::F32, values.data(), values.size());
}

}  // namespace mote
