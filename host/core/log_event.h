// What happens, as a sentence for people or, with `--log json`, as one JSON object a line for programs:
//   {"time": "2026-11-26T22:00:00.123Z", "event": NAME, fields…}
// docs/log.md lists the events and their fields.
#pragma once
#include <concepts>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace mote {

enum class LogFormat { Text, Json };

/// Process-wide; set once by `main`.
void setLogFormat(LogFormat format);
LogFormat logFormat();

using LogSeconds = std::map<std::string, double>;  ///< stage by stage

/// A field's value. Numbers are written with six digits; what is not finite as null; bytes that are no UTF-8 as U+FFFD.
struct LogValue : std::variant<std::int64_t, double, std::string, LogSeconds> {
  template <std::integral T>
  LogValue(T value) : variant(static_cast<std::int64_t>(value)) {}
  LogValue(double value) : variant(value) {}
  LogValue(std::string value) : variant(std::move(value)) {}
  LogValue(const char* value) : variant(std::string(value)) {}
  LogValue(LogSeconds value) : variant(std::move(value)) {}
};
struct LogField {
  std::string name;
  LogValue value;
};
using LogFields = std::vector<LogField>;

/// Something that went as it should: `text` for people ("" where they need none), the event for programs. Nothing with
/// -q.
void logEvent(std::string_view name, const LogFields& fields, std::string_view text = "");
/// Something that failed: as logEvent, but shown with -q too.
void logFailure(std::string_view name, const LogFields& fields, std::string_view text = "");

/// The frame at work: from now on a field `frame` of every event; none once there is none.
void setEventFrame(std::optional<int> frame);

}  // namespace mote
