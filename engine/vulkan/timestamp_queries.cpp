#include "engine/vulkan/timestamp_queries.h"

#include <algorithm>
#include <array>

#include "engine/vulkan/check.h"

namespace mote {

std::uint32_t TimestampQueries::begin(CommandBuffer& commands, std::string stage) {
  MOTE_CHECK(stages_.size(), <, capacity_);
  const auto span = static_cast<std::uint32_t>(stages_.size());
  stages_.push_back(std::move(stage));
  vkCmdWriteTimestamp2(commands.handle(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, pool_.get(), 2 * span);
  return span;
}

void TimestampQueries::end(CommandBuffer& commands, std::uint32_t span) {
  MOTE_CHECK(span, <, stages_.size());
  vkCmdWriteTimestamp2(commands.handle(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, pool_.get(), 2 * span + 1);
}

std::vector<StageTime> TimestampQueries::results() const {
  std::vector<StageTime> times;
  for (std::uint32_t span = 0; span < stages_.size(); ++span) {
    std::array<std::uint64_t, 2> ticks{};
    vkCheck(vkGetQueryPoolResults(pool_.device(), pool_.get(), 2 * span, 2, sizeof ticks, ticks.data(), sizeof ticks[0],
                                  VK_QUERY_RESULT_64_BIT),
            "vkGetQueryPoolResults", fmt::format("stage {}", stages_[span]));
    const double seconds = static_cast<double>((ticks[1] - ticks[0]) & tickMask_) * secondsPerTick_;
    const auto same = [&](const StageTime& time) { return time.stage == stages_[span]; };
    const auto known = std::find_if(times.begin(), times.end(), same);
    if (known == times.end())
      times.push_back({stages_[span], seconds});
    else
      known->seconds += seconds;
  }
  return times;
}

void TimestampQueries::reset() {
  stages_.clear();
  vkResetQueryPool(pool_.device(), pool_.get(), 0, 2 * capacity_);
}

}  // namespace mote
