#include "host/particles/formats/channel_sink.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "host/core/error.h"
#include "host/particles/formats/number_visit.h"

namespace mote {
namespace {

template <class To, class From>
To converted(From value) {
  if constexpr (std::is_same_v<To, std::uint64_t> && !std::is_integral_v<From>) {
    const double number = static_cast<double>(value);
    return number >= 0 && number < 0x1p64 ? static_cast<std::uint64_t>(number) : 0;
  } else {
    return static_cast<To>(value);
  }
}

template <class T>
T numberAt(const std::byte* from, bool swapped) {
  std::byte bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (swapped) std::reverse(std::begin(bytes), std::end(bytes));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Numbers as they stand in a file, one particle after another.
struct Rows {
  const std::byte* from;
  std::size_t stride, count;
  bool swapped;
};

/// Copies `components` numbers of each particle.
template <class From, class To>
void convertColumn(Rows rows, int components, bool broadcast, To* to) {
  for (std::size_t i = 0; i < rows.count; ++i, rows.from += rows.stride)
    for (int c = 0; c < components; ++c)
      *to++ = converted<To>(
          numberAt<From>(rows.from + (broadcast ? 0 : static_cast<std::size_t>(c) * sizeof(From)), rows.swapped));
}

template <class To>
void convert(NumberType type, const Rows& rows, int components, bool broadcast, To* to) {
  withNumberType(type, [&]<class From>(From) { convertColumn<From>(rows, components, broadcast, to); });
}

/// From what the file's numbers are to what they stand for.
template <class To>
void scaleBy(double factor, std::span<To> numbers) {
  if (factor == 1) return;
  for (To& number : numbers) number = converted<To>(static_cast<double>(number) * factor);
}

template <class Target>
constexpr bool kIsRaw = std::is_same_v<Target, std::vector<std::byte>> || std::is_same_v<Target, RawTaker>;

template <class T>
constexpr bool kIsVector = std::is_same_v<T, vec3> || std::is_same_v<T, dvec3>;

template <class T>
void appendTo(std::vector<T>& to, const Channel& channel, const Rows& rows) {
  if (rows.count == 0) return;
  if constexpr (std::is_same_v<T, std::byte>) {
    const std::size_t size = numberSize(channel.type), bytes = channel.bytes(), old = to.size();
    to.resize(old + rows.count * bytes);
    std::byte* out = to.data() + old;
    const std::byte* from = rows.from;
    for (std::size_t i = 0; i < rows.count; ++i, from += rows.stride, out += bytes) {
      std::memcpy(out, from, bytes);
      if (rows.swapped)
        for (std::size_t c = 0; c < bytes; c += size) std::reverse(out + c, out + c + size);
    }
  } else {
    const std::size_t old = to.size();
    to.resize(old + rows.count);
    if constexpr (kIsVector<T>) {
      auto* first = &to[old].x;
      convert(channel.type, rows, 3, channel.arity == 1, first);
      scaleBy(channel.scale, std::span(first, 3 * rows.count));
    } else {
      convert(channel.type, rows, 1, false, &to[old]);
      scaleBy(channel.scale, std::span(to).subspan(old));
    }
  }
}

/// Throws where a channel's numbers are none of type T.
template <class T>
void requireArity(const std::string& path, const Channel& channel) {
  if (channel.arity == 1 || (kIsVector<T> && channel.arity >= 3)) return;
  throw InputError(path, fmt::format("channel '{}'", channel.name),
                   kIsVector<T> ? "arity 3 (or 1, or more)" : "arity 1", fmt::format("arity {}", channel.arity));
}

}  // namespace

std::string describeChannels(std::span<const Channel> channels) {
  std::string text;
  for (const Channel& c : channels) {
    if (!text.empty()) text += ", ";
    text += c.arity == 1 ? fmt::format("{} ({})", c.name, numberName(c.type))
                         : fmt::format("{} ({} × {})", c.name, c.arity, numberName(c.type));
  }
  return text;
}

ChannelSink::ChannelSink(const std::string& path, std::span<const Channel> channels, const ChannelRequest& request)
    : target_(request.target) {
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [&](const Channel& channel) { return channel.name == request.channel; });
  if (found == channels.end())
    throw InputError(path, "", fmt::format("a channel '{}'", request.channel), "none of that name",
                     "it has " + describeChannels(channels));
  index_ = static_cast<std::size_t>(found - channels.begin());
  channel_ = *found;
  std::visit(
      [&]<class Target>(Target*) {
        if constexpr (!kIsRaw<Target>) requireArity<typename Target::value_type>(path, channel_);
      },
      target_);
}

void ChannelSink::reserve(std::uint64_t particles) {
  std::visit(
      [&]<class Target>(Target* to) {
        if constexpr (!std::is_same_v<Target, RawTaker>) {
          to->clear();
          to->reserve(particles * (kIsRaw<Target> ? channel_.bytes() : 1));
        }
      },
      target_);
}

void ChannelSink::append(const std::byte* from, std::size_t stride, std::size_t count, bool bigEndian) {
  const Rows rows{from, stride, count, bigEndian};
  std::visit(
      [&]<class Target>(Target* to) {
        if constexpr (std::is_same_v<Target, RawTaker>) {
          std::vector<std::byte> piece;
          appendTo(piece, channel_, rows);
          if (count > 0) (*to)(std::move(piece));
        } else {
          appendTo(*to, channel_, rows);
        }
      },
      target_);
}

}  // namespace mote
