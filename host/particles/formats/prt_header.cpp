#include "host/particles/formats/prt_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <set>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

// No producer comes near; it keeps the buffer that one particle needs small whatever an arity claims.
constexpr std::uint64_t kMaxParticleBytes = 1 << 20;

struct Parser {
  const InputFile& file;
  bool salvage = false;
  PrtHeader header{};
  bool countKnown = true;
  const std::string& path = file.path();
  const std::uint64_t fileBytes = file.bytes();

  [[noreturn]] void fail(std::string_view field, std::string_view expected, std::string_view got,
                         std::string_view hint = {}) const {
    throw InputError(path, field, expected, got, hint);
  }

  /// Bytes 0 to 56; returns the header's length.
  std::uint64_t parseFixed() {
    Section section(file, 0, fileBytes);
    const std::string magic = section.bytes(sizeof kPrtMagic, "PRT magic number");
    if (magic.compare(0, 5, "\xC0PRT2") == 0) fail("", "a PRT 1.0 or 1.1 file", "PRT 2");
    if (std::memcmp(magic.data(), kPrtMagic, sizeof kPrtMagic) != 0)
      fail("", "a PRT file, which starts with the bytes C0 50 52 54 0D 0A 1A 0A", shown(magic),
           "is it another format, or was it sent as text?");
    const auto length = section.number<std::int32_t>("header length");
    const std::string signature = section.bytes(sizeof kPrtSignature, "signature");
    if (std::memcmp(signature.data(), kPrtSignature, sizeof kPrtSignature) != 0)
      fail("signature", "'Extensible Particle Format', padded with zeros", shown(signature));
    const auto version = section.number<std::int32_t>("version");
    if (version != 1 && version != 2) fail("version", "1 (PRT 1.0) or 2 (PRT 1.1)", fmt::format("{}", version));
    header.minorVersion = version - 1;
    const auto count = section.number<std::int64_t>("particle count");
    countKnown = count >= 0;
    if (count == -1 && !salvage)
      fail("particle count", "0 or more", "-1",
           "the file was not closed correctly: the program writing it crashed or is still running; mote repair IN OUT "
           "saves the particles that are there");
    if (count < 0 && !salvage) fail("particle count", "0 or more", fmt::format("{}", count));
    header.count = countKnown ? static_cast<std::uint64_t>(count) : 0;
    if (length < static_cast<std::int32_t>(kPrtFixedHeader))
      fail("header length", fmt::format("at least {} bytes", kPrtFixedHeader), fmt::format("{}", length));
    if (static_cast<std::uint64_t>(length) > fileBytes)
      fail("header length", fmt::format("at most the file's {} bytes", fileBytes), fmt::format("{}", length),
           "the file is cut off or its header is damaged");
    return static_cast<std::uint64_t>(length);
  }

  /// Chunks of a 1.1 header, up to `Stop`.
  void parseChunks(std::uint64_t end) {
    Section section(file, kPrtFixedHeader, end);
    while (true) {
      if (section.left() == 0) fail("metadata", "a Stop chunk at its end", "none before the channels");
      const std::string kind = section.bytes(4, "metadata chunk type");
      const auto length = section.number<std::int32_t>("metadata chunk length");
      if (length < 0 || static_cast<std::uint64_t>(length) > section.left())
        fail(fmt::format("metadata chunk {} at byte {}", shown(kind), section.position() - 8),
             fmt::format("a length of 0 to {} bytes, what is left of the header", section.left()),
             fmt::format("{}", length));
      const auto size = static_cast<std::uint64_t>(length);
      if (kind == "Stop") {
        if (size != 0) fail("metadata chunk 'Stop'", "a length of 0", fmt::format("{}", length));
        if (section.left() > 0)
          logWarning(fmt::format("{}: ignored {} bytes behind the metadata's Stop chunk", path, section.left()));
        section.skip(section.left());
        return;
      }
      if (kind == "Meta")
        parseMeta(section.bytes(size, "metadata"));
      else
        section.skip(size);
    }
  }

  std::string takeName(std::string_view& rest, const char* what) const {
    const std::size_t zero = rest.substr(0, 32).find('\0');
    if (zero == std::string_view::npos)
      fail(fmt::format("metadata {}", what), "at most 31 characters and a zero", shown(rest.substr(0, 32)));
    std::string name(rest.substr(0, zero));
    rest.remove_prefix(zero + 1);
    return name;
  }

  void parseMeta(const std::string& chunk) {
    std::string_view rest = chunk;
    Metadata value;
    value.channel = takeName(rest, "channel name");
    value.name = takeName(rest, "value name");
    // Old Sequoia files name channel values "Channel.Prop" in the file's scope.
    if (const auto dot = value.name.find('.'); value.channel.empty() && dot != std::string::npos) {
      value.channel = value.name.substr(0, dot);
      value.name.erase(0, dot + 1);
    }
    const std::string field =
        fmt::format("metadata {}", value.channel.empty() ? shown(value.name) : shown(value.channel + "." + value.name));
    if (!value.channel.empty() && !prtNameIsValid(value.channel)) fail(field, "a channel's name", shown(value.channel));
    if (value.name.empty()) fail(field, "a name", "an empty one");
    if (rest.size() < 4) fail(field, "a type of 4 bytes", fmt::format("{} bytes", rest.size()));
    std::memcpy(&value.type, rest.data(), 4);
    rest.remove_prefix(4);
    if (value.type == kMetadataText) {
      const std::size_t zero = rest.find('\0');
      if (zero == std::string_view::npos) fail(field, "text with a zero at its end", "none");
      value.bytes = rest.substr(0, zero);
    } else {
      if (value.type < 0 || value.type >= kNumberTypes)
        fail(field, "a type of 0 to 10, or -1 for text", fmt::format("{}", value.type));
      const std::size_t size = numberSize(static_cast<NumberType>(value.type));
      if (rest.size() % size != 0)
        fail(field, fmt::format("a multiple of {} bytes ({})", size, numberName(static_cast<NumberType>(value.type))),
             fmt::format("{} bytes", rest.size()));
      value.bytes = rest;
    }
    if (header.meta(value.channel, value.name)) {
      logWarning(fmt::format("{}: {} stands twice in the metadata; the first is kept", path, field));
      return;
    }
    header.metadata.push_back(std::move(value));
  }

  /// The channel table behind the header. Returns where the particles begin.
  std::uint64_t parseChannels(std::uint64_t begin) {
    Section section(file, begin, fileBytes);
    const auto reserved = section.number<std::int32_t>("reserved number");
    if (reserved != 4) fail("reserved number", "4", fmt::format("{}", reserved));
    const auto count = section.number<std::int32_t>("channel count");
    const auto record = section.number<std::int32_t>("channel record length");
    if (count < 1) fail("channel count", "1 or more", fmt::format("{}", count));
    if (record < static_cast<std::int32_t>(kPrtChannelRecord))
      fail("channel record length", fmt::format("at least {} bytes", kPrtChannelRecord), fmt::format("{}", record));
    const std::uint64_t needed = static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(record);
    if (needed > section.left())
      fail("channel table", fmt::format("{} records of {} bytes", count, record),
           fmt::format("only {} bytes in the file", section.left()), "the file is cut off or its header is damaged");
    requireFewChannels(path, static_cast<std::uint64_t>(count));
    std::set<std::string> names;
    for (std::int32_t i = 0; i < count; ++i) {
      PrtChannel channel = parseChannel(section, i);
      section.skip(static_cast<std::uint64_t>(record) - kPrtChannelRecord);
      if (!names.insert(channel.name).second)
        fail(fmt::format("channel {}", i), "a name of its own", fmt::format("'{}' a second time", channel.name));
      header.channels.push_back(std::move(channel));
    }
    checkLayout();
    return section.position();
  }

  PrtChannel parseChannel(Section& section, std::int32_t index) const {
    const std::string name = section.bytes(32, "channel name");
    const auto type = section.number<std::int32_t>("channel type");
    const auto arity = section.number<std::int32_t>("channel arity");
    const auto offset = section.number<std::int32_t>("channel offset");
    const std::size_t zero = name.find('\0');
    if (zero == std::string::npos)
      fail(fmt::format("channel {}: name", index), "at most 31 characters and a zero", shown(name));
    PrtChannel channel;
    channel.name = name.substr(0, zero);
    if (!prtNameIsValid(channel.name))
      fail(fmt::format("channel {}: name", index), "a letter or '_', then letters, digits and '_'",
           shown(channel.name));
    const std::string field = fmt::format("channel '{}'", channel.name);
    if (type < 0 || type >= kNumberTypes) fail(field + ": type", "0 to 10", fmt::format("{}", type));
    if (arity < 1) fail(field + ": arity", "1 or more", fmt::format("{}", arity));
    if (offset < 0) fail(field + ": offset", "0 or more", fmt::format("{}", offset));
    channel.type = static_cast<NumberType>(type);
    channel.arity = static_cast<std::uint32_t>(arity);
    channel.offset = static_cast<std::uint32_t>(offset);
    if (channel.offset + std::uint64_t{channel.bytes()} > kMaxParticleBytes)
      fail(field, fmt::format("an end within {} bytes of the particle's start", kMaxParticleBytes),
           fmt::format("offset {}, {} × {}", offset, arity, numberName(channel.type)));
    return channel;
  }

  /// Gaps are legal, overlaps are not.
  void checkLayout() {
    std::vector<const PrtChannel*> order;
    for (const PrtChannel& c : header.channels) order.push_back(&c);
    std::sort(order.begin(), order.end(), [](auto a, auto b) { return a->offset < b->offset; });
    const PrtChannel* before = nullptr;
    for (const PrtChannel* c : order) {
      if (before && c->offset < header.particleBytes)
        fail(fmt::format("channel '{}': offset", c->name),
             fmt::format("at least {}, the end of '{}'", header.particleBytes, before->name),
             fmt::format("{}", c->offset), "channels overlap");
      header.particleBytes = c->offset + c->bytes();
      before = c;
    }
  }

  /// What metadata say about channels, once these are known.
  void checkChannelMetadata() {
    auto& all = header.metadata;
    for (const Metadata& m : all) {
      if (m.channel.empty()) continue;
      const PrtChannel* channel = header.channel(m.channel);
      if (!channel)
        logWarning(fmt::format("{}: dropped metadata '{}' of '{}', a channel that the file does not have", path, m.name,
                               m.channel));
      else if (m.name == "Interpretation")
        checkInterpretation(m, *channel);
    }
    std::erase_if(all, [&](const Metadata& m) { return !m.channel.empty() && !header.channel(m.channel); });
  }

  void checkInterpretation(const Metadata& m, const PrtChannel& channel) const {
    if (m.type != static_cast<std::int32_t>(NumberType::I32) || m.bytes.size() != 4)
      return;  // somebody else's property
    std::int32_t kind;
    std::memcpy(&kind, m.bytes.data(), 4);
    if ((kind == 4 || kind == 5) && channel.arity != 4)
      fail(fmt::format("metadata '{}.Interpretation'", channel.name),
           fmt::format("arity 4 for {}", kind == 4 ? "an orientation" : "a rotation"),
           fmt::format("{}", channel.arity));
  }
};

}  // namespace

ParsedPrtHeader parsePrtHeader(const InputFile& file, bool salvage) {
  Parser parser{file, salvage};
  const std::uint64_t length = parser.parseFixed();
  if (parser.header.minorVersion == 1) parser.parseChunks(length);
  const std::uint64_t dataBegin = parser.parseChannels(length);
  parser.checkChannelMetadata();
  return {std::move(parser.header), parser.countKnown, dataBegin};
}

}  // namespace mote
