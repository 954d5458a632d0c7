// Memory of a device, and the budget that all of it counts against.
#pragma once
#include <volk.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "engine/vulkan/handle.h"

namespace mote {

/// How much of a device's memory may be held: `bytes`, or where that is 0 this share of its device-local heap.
struct MemoryLimit {
  std::uint64_t bytes = 0;
  double share = 0.9;  // the rest is for the driver, other programs and the screen
};

/// What may be held, is held, and was held at most [bytes]. For one thread, as the device it belongs to.
class MemoryBudget {
 public:
  std::uint64_t limit() const { return limit_; }
  std::uint64_t held() const { return held_; }
  std::uint64_t peak() const { return peak_; }
  std::uint64_t room() const { return limit_ - std::min(held_, limit_); }

 private:
  friend class Device;
  friend class DeviceMemory;
  void take(std::uint64_t bytes) { held_ += bytes, peak_ = std::max(peak_, held_); }
  void giveBack(std::uint64_t bytes) { held_ -= bytes; }

  std::uint64_t limit_ = 0, held_ = 0, peak_ = 0;
};

/// One allocation: move-only, frees what it holds and gives its bytes back to the budget. Made by Device.
class DeviceMemory {
 public:
  DeviceMemory() = default;
  DeviceMemory(DeviceMemory&& other) noexcept
      : memory_(std::move(other.memory_)),
        budget_(std::exchange(other.budget_, nullptr)),
        bytes_(std::exchange(other.bytes_, 0)) {}
  DeviceMemory& operator=(DeviceMemory&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(budget_, other.budget_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~DeviceMemory() {
    if (budget_) budget_->giveBack(bytes_);
  }
  VkDeviceMemory get() const { return memory_.get(); }

 private:
  friend class Device;
  DeviceHandle<VkDeviceMemory, &vkFreeMemory> memory_;
  MemoryBudget* budget_ = nullptr;  // null where the memory is the host's
  std::uint64_t bytes_ = 0;
};

}  // namespace mote
