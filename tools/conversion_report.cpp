#include "tools/conversion_report.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/info.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

std::string typeText(NumberType type, std::uint32_t arity) {
  return arity == 1 ? std::string(numberName(type)) : fmt::format("{} × {}", arity, numberName(type));
}

/// "from v (float64), 3 numbers changed".
std::string remarkOf(const WrittenChannel& written, std::uint64_t particles) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  const bool renamed = written.from != written.channel.name, cast = written.fromType != written.channel.type;
  if (renamed || cast)
    add(fmt::format("from{}{}", renamed ? " " + written.from : "",
                    cast ? fmt::format(" {}", numberName(written.fromType)) : ""));
  if (cast && written.changed > 0)
    add(fmt::format("{} of {} numbers changed", written.changed, particles * written.channel.arity));
  if (written.filled > 0) add(fmt::format("{} particles had none and got {:g}", written.filled, written.fill));
  return text;
}

}  // namespace

Json conversionJson(const ConversionReport& report) {
  Json channels = Json::array();
  for (const WrittenChannel& w : report.channels)
    channels.push_back({{"name", w.channel.name},
                        {"type", numberName(w.channel.type)},
                        {"arity", w.channel.arity},
                        {"from", w.from},
                        {"from_type", numberName(w.fromType)},
                        {"changed", w.changed},
                        {"filled", w.filled}});
  return {{"file", report.path},
          {"format", report.format},
          {"read", report.read},
          {"written", report.written},
          {"bytes", report.bytes},
          {"channels", channels},
          {"lost_metadata", report.lostMetadata},
          {"notes", report.notes}};
}

void printConversion(const ConversionReport& report) {
  fmt::print("{}: {}, {} particles{}, {}\n", report.path, report.format, report.written,
             report.written == report.read ? "" : fmt::format(" of {}", report.read),
             bytesText(static_cast<double>(report.bytes)));
  for (const WrittenChannel& w : report.channels) {
    const std::string remark = remarkOf(w, report.written);
    const std::string type = typeText(w.channel.type, w.channel.arity);
    if (remark.empty())
      fmt::print("  {:<23} {}\n", w.channel.name, type);
    else
      fmt::print("  {:<23} {:<12} {}\n", w.channel.name, type, remark);
  }
  if (!report.lostMetadata.empty()) {
    std::string names;
    for (const std::string& name : report.lostMetadata) names += (names.empty() ? "" : ", ") + name;
    fmt::print("  left out, as {} cannot hold them: metadata {}\n", report.format, names);
  }
  for (const std::string& note : report.notes) fmt::print("  note: {}\n", note);
}

}  // namespace mote
