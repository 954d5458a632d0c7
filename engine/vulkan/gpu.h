// Instance and device in one: what the renderer, the tools and the tests open.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/vulkan/device.h"
#include "engine/vulkan/instance.h"
#include "engine/vulkan/physical_device.h"

namespace mote {

struct DeviceOptions {
  std::string device = {};   // number or part of the name; empty: the best
  bool validate = false;     // validation and synchronization layers
  bool stageAlways = false;  // see Device
  MemoryLimit memory = {};
  std::optional<std::uint8_t> fill = {};  // see Device
  std::string limits = {};                // for tests: what the device says instead, see readFacts
  std::string faults = {};                // for tests: what fails, see FaultPlan
};

/// Move-only; whatever its device made must be destroyed before it.
class Gpu {
 public:
  /// Throws as Instance and chooseDevice do.
  explicit Gpu(const DeviceOptions& options);
  Gpu(Gpu&&) = default;
  Gpu& operator=(Gpu&&) = delete;  // would destroy the instance before its device
  Device& device() const { return *device_; }
  /// False between close() and reopen().
  bool isOpen() const { return device_ != nullptr; }
  /// Destroys the device; whatever it made must be gone.
  void close() { device_.reset(); }
  /// A new device in the place of the old, which is closed; it may hold `bytes` of memory. Throws as the constructor
  /// does; then there is none.
  void reopen(std::uint64_t bytes);
  const Instance& instance() const { return *instance_; }
  std::vector<std::string> validationMessages() const { return instance_->validationMessages(); }

 private:
  DeviceOptions options_;
  std::shared_ptr<FaultPlan> faults_;
  std::unique_ptr<Instance> instance_;
  std::unique_ptr<Device> device_;
};

}  // namespace mote
