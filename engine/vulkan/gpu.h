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
};

/// Move-only; whatever its device made must be destroyed before it.
class Gpu {
 public:
  /// Throws as Instance and chooseDevice do.
  explicit Gpu(const DeviceOptions& options);
  Gpu(Gpu&&) = default;
  Gpu& operator=(Gpu&&) = delete;  // would destroy the instance before its device
  Device& device() const { return *device_; }
  const Instance& instance() const { return *instance_; }
  std::vector<std::string> validationMessages() const { return instance_->validationMessages(); }

 private:
  std::unique_ptr<Instance> instance_;
  std::unique_ptr<Device> device_;
};

}  // namespace mote
