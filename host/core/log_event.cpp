#include "host/core/log_event.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/core/error_line.h"
#include "host/core/log.h"

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

std::atomic<LogFormat> currentFormat{LogFormat::Text};

constexpr std::int64_t kNoFrame = std::numeric_limits<std::int64_t>::min();
std::atomic<std::int64_t> currentFrame{kNoFrame};

/// Of this moment, UTC.
std::string timeStamp() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  const std::time_t seconds = milliseconds / 1000;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  return fmt::format("{}.{:03}Z", text, milliseconds % 1000);
}

Json toJson(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr);
}
Json toJson(std::int64_t value) { return value; }
Json toJson(const std::string& value) { return value; }
Json toJson(const LogSeconds& seconds) {
  Json object = Json::object();
  for (const auto& [stage, value] : seconds) object[stage] = toJson(value);
  return object;
}

void write(std::string_view name, const LogFields& fields, std::string_view text) {
  if (logFormat() == LogFormat::Text) {
    if (!text.empty()) writeErrorLine(text);
    return;
  }
  Json event = {{"time", timeStamp()}, {"event", name}};
  if (const std::int64_t frame = currentFrame; frame != kNoFrame) event["frame"] = frame;
  for (const LogField& field : fields)
    event[field.name] = std::visit([](const auto& value) { return toJson(value); }, field.value);
  writeErrorLine(event.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

void setLogFormat(LogFormat format) { currentFormat = format; }
LogFormat logFormat() { return currentFormat; }
void setEventFrame(std::optional<int> frame) { currentFrame = frame ? *frame : kNoFrame; }

void logEvent(std::string_view name, const LogFields& fields, std::string_view text) {
  if (verbosity() != Verbosity::Quiet) write(name, fields, text);
}
void logFailure(std::string_view name, const LogFields& fields, std::string_view text) { write(name, fields, text); }

}  // namespace mote
