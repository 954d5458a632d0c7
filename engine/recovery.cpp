#include "engine/recovery.h"

#include <algorithm>
#include <string_view>

#include "engine/vulkan/check.h"
#include "host/core/log.h"

namespace mote {
namespace {

/// The story of one step, for whoever reads the warning.
class Story {
 public:
  Story(std::string step, std::string device) : step_(std::move(step)), device_(std::move(device)) {}

  void failed(std::string_view how) {
    text_ += tries_ == 0    ? fmt::format("{} on {}: {}", step_, device_, how)
             : how == last_ ? std::string(", which failed in the same way")
                            : fmt::format(", which failed: {}", how);
    last_ = how;
  }
  void repeated(std::string_view how) { text_ += fmt::format("; {} {}", tries_++ == 0 ? "repeated" : "then", how); }
  bool empty() const { return text_.empty(); }
  const std::string& text() const { return text_; }

 private:
  std::string step_, device_, text_, last_;
  int tries_ = 0;
};

}  // namespace

bool Recovery::onDevice(int frame, const std::string& step, bool mayLeave, const std::function<void()>& work) {
  static const std::string kClosed = "the Vulkan device";
  Story story(step, gpu_.isOpen() ? gpu_.device().name() : kClosed);
  std::uint64_t& limit = lowered_.try_emplace(step, limit_).first->second;
  bool reopened = false;
  for (int halvings = 0;;) {
    DeviceFault fault = DeviceFault::Refused;
    try {
      if (!gpu_.isOpen()) gpu_.reopen(limit);
      gpu_.device().limitMemory(limit);
      work();
      if (!story.empty()) logWarning(fmt::format("frame {}: {}, and that went well", frame, story.text()));
      return true;
    } catch (const DeviceError& error) {
      fault = error.fault();
      story.failed(error.what());
      if (fault == DeviceFault::Memory && halvings < kMostHalvings && gpu_.isOpen()) {
        const std::uint64_t wanted = gpu_.device().budget().peak() + error.bytes();
        const std::uint64_t half = std::min(limit, wanted > 0 ? wanted : limit) / 2;
        if (const std::uint64_t next = std::max(half, kLeastLimit); next < limit) {
          ++halvings;
          limit = next;
          story.repeated(fmt::format("in parts that hold at most {} bytes of its memory", limit));
          continue;
        }
      }
    } catch (const MachineError& error) {
      if (gpu_.isOpen()) throw;  // of the work, and none of the device's
      story.failed(error.what());
    }
    if (fault == DeviceFault::Lost) {
      gpu_.close();
      if (!std::exchange(reopened, true)) {
        story.repeated("with the device opened anew");
        continue;
      }
    }
    break;
  }
  if (mayLeave) {
    logWarning(fmt::format("frame {}: {}; done on the CPU, as all later frames are", frame, story.text()));
    return false;
  }
  limit = limit_;
  throw MachineError(story.text() + "; --lighting auto and --raster auto go on on the CPU");
}

}  // namespace mote
