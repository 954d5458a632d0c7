#include "host/particles/formats/houdini_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <string_view>

#include "host/core/error.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/houdini_numbers.h"

namespace mote {
namespace {

constexpr char kBinaryMagic[] = {'\x7f', 'N', 'S', 'J', 'b'};

bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// A list or map whose first key is one that Houdini's begin with.
bool beginsAsText(std::string_view start) {
  const auto next = [&] {
    while (!start.empty() && isSpace(start[0])) start.remove_prefix(1);
  };
  next();
  if (start.empty() || (start[0] != '[' && start[0] != '{')) return false;
  start.remove_prefix(1);
  next();
  return start.starts_with("\"fileversion\"") || start.starts_with("\"pointcount\"");
}

bool beginsAsBinary(std::span<const std::byte> start) {
  return start.size() >= sizeof kBinaryMagic && std::memcmp(start.data(), kBinaryMagic, sizeof kBinaryMagic) == 0;
}

std::string_view asText(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

bool beginsAsHoudini(std::span<const std::byte> start) {
  return beginsAsBinary(start) || beginsAsScf(start) || beginsAsText(asText(start));
}

HoudiniReader::HoudiniReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  constexpr std::size_t kStart = 256;
  std::vector<std::byte> start(kStart);
  start.resize(file_.read(start.data(), kStart));
  binary_ = beginsAsBinary(start);
  if (!binary_ && !beginsAsText(asText(start)))
    throw InputError(path_, "", "Houdini geometry in what is packed", "something else",
                     "Blosc's packing (.sc) is read of .bgeo and .geo alone");
  HoudiniOutline outline(path_);
  file_.seek(binary_ ? sizeof kBinaryMagic : 0);
  binary_ ? readBinaryJson(file_, outline) : readTextJson(file_, outline);
  outline.finish(file_.bytes() * kDeflateExpansion);
  count_ = outline.points();
  attributes_ = outline.attributes();
  metadata_ = outline.metadata();
  for (const HoudiniAttribute& attribute : attributes_) channels_.push_back(attribute.channel);
  const std::string version = outline.version().empty() ? "" : " " + outline.version();
  const std::string packing = *file_.packing() ? fmt::format(", {}", file_.packing()) : "";
  format_ = fmt::format("Houdini{} ({}{})", version, binary_ ? "binary JSON" : "JSON", packing);
}

void HoudiniReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  std::vector<std::vector<ChannelSink*>> wanted(attributes_.size());
  for (ChannelSink& sink : sinks) wanted[sink.index()].push_back(&sink);
  try {
    for (ChannelSink& sink : sinks) sink.reserve(std::min(count_, file_.bytes()));
    for (std::size_t k = 0; k < attributes_.size(); ++k) {  // in the file's order, so that nothing is unpacked twice
      if (wanted[k].empty()) continue;
      HoudiniNumbers numbers(path_, attributes_[k], count_, wanted[k]);
      file_.seek(attributes_[k].values.begin);
      binary_ ? readBinaryJson(file_, numbers) : readTextJson(file_, numbers);
      numbers.finish();
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} points", path_, count_));
  }
}

}  // namespace mote
