// A device that may hold little, for tests of what is done in parts.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "engine/vulkan/gpu.h"
#include "tests/gpu/gpu_fixture.h"

namespace mote {

/// A device of its own that may hold `bytes`, and that must not have held more at the end.
class SmallDevice {
 public:
  explicit SmallDevice(std::uint64_t bytes, bool stageAlways = false)
      : gpu_(DeviceOptions{
            .validate = true, .stageAlways = stageAlways, .memory = {.bytes = bytes}, .fill = kUnwritten}) {}
  ~SmallDevice() {
    const MemoryBudget& budget = device().budget();
    EXPECT_LE(budget.peak(), budget.limit());
    EXPECT_GT(budget.peak(), budget.limit() / 4) << "hardly any of it was used";
    EXPECT_EQ(budget.held(), 0u);
    EXPECT_EQ(gpu_.validationMessages(), std::vector<std::string>{});
  }
  const Device& device() const { return gpu_.device(); }

 private:
  Gpu gpu_;
};

}  // namespace mote
