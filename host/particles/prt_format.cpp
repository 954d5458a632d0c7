#include "host/particles/prt_format.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

namespace mote {

static_assert(std::endian::native == std::endian::little, "PRT numbers are copied as they stand in memory");

namespace {

struct TypeFacts {
  std::string_view name;
  std::size_t size;
};
constexpr TypeFacts kTypes[kPrtTypes] = {{"int16", 2},   {"int32", 4},   {"int64", 8},  {"float16", 2},
                                         {"float32", 4}, {"float64", 8}, {"uint16", 2}, {"uint32", 4},
                                         {"uint64", 8},  {"int8", 1},    {"uint8", 1}};

template <class T>
std::string rawBytes(const T* values, std::size_t count) {
  std::string bytes(sizeof(T) * count, '\0');
  if (count > 0) std::memcpy(bytes.data(), values, bytes.size());
  return bytes;
}

bool isLetter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_'; }

}  // namespace

std::size_t prtTypeSize(PrtType type) { return kTypes[static_cast<std::size_t>(type)].size; }
std::string_view prtTypeName(PrtType type) { return kTypes[static_cast<std::size_t>(type)].name; }

PrtMetadata PrtMetadata::text(std::string channel, std::string name, std::string text) {
  return {std::move(channel), std::move(name), kPrtText, std::move(text)};
}
PrtMetadata PrtMetadata::int32(std::string channel, std::string name, std::int32_t value) {
  return {std::move(channel), std::move(name), static_cast<std::int32_t>(PrtType::I32), rawBytes(&value, 1)};
}
PrtMetadata PrtMetadata::float64(std::string channel, std::string name, double value) {
  return {std::move(channel), std::move(name), static_cast<std::int32_t>(PrtType::F64), rawBytes(&value, 1)};
}
PrtMetadata PrtMetadata::float32s(std::string channel, std::string name, const std::vector<float>& values) {
  return {std::move(channel), std::move(name), static_cast<std::int32_t>(PrtType::F32),
          rawBytes(values.data(), values.size())};
}

const PrtChannel* PrtHeader::channel(std::string_view name) const {
  for (const PrtChannel& c : channels)
    if (c.name == name) return &c;
  return nullptr;
}

const PrtMetadata* PrtHeader::meta(std::string_view channel, std::string_view name) const {
  for (const PrtMetadata& m : metadata)
    if (m.channel == channel && m.name == name) return &m;
  return nullptr;
}

std::string PrtHeader::describeChannels() const {
  std::string text;
  for (const PrtChannel& c : channels) {
    if (!text.empty()) text += ", ";
    text += c.arity == 1 ? fmt::format("{} ({})", c.name, prtTypeName(c.type))
                         : fmt::format("{} ({} × {})", c.name, c.arity, prtTypeName(c.type));
  }
  return text;
}

bool prtNameIsValid(std::string_view name) {
  if (name.empty() || name.size() > 31 || !isLetter(name[0])) return false;
  for (const char c : name)
    if (!isLetter(c) && !(c >= '0' && c <= '9')) return false;
  return true;
}

}  // namespace mote
