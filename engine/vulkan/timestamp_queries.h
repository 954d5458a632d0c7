// Seconds of the device's own clock between two points of a command buffer.
#pragma once
#include <volk.h>

#include <cstdint>
#include <string>
#include <vector>

#include "engine/vulkan/command_buffer.h"
#include "engine/vulkan/handle.h"

namespace mote {

struct StageTime {
  std::string stage;
  double seconds;
};

/// A fixed number of named spans. Created by Device::createTimestampQueries.
class TimestampQueries {
 public:
  TimestampQueries() = default;

  /// Starts a span, outside of rendering; returns its number for end(). Spans may overlap; one name may have several.
  std::uint32_t begin(CommandBuffer& commands, std::string stage);
  void end(CommandBuffer& commands, std::uint32_t span);

  /// After the submissions have finished: one entry a name, in the order of first use, spans of one name added up.
  std::vector<StageTime> results() const;
  /// Forgets all spans, so that the next frame can be measured. Not while a submission with them is under way.
  void reset();

 private:
  friend class Device;
  DeviceHandle<VkQueryPool, &vkDestroyQueryPool> pool_;
  std::vector<std::string> stages_;
  std::uint32_t capacity_ = 0;
  double secondsPerTick_ = 0;
  std::uint64_t tickMask_ = 0;  // devices count in 36–64 bits
};

}  // namespace mote
