// SPIR-V as the device holds it, and the constants that specialise it.
#pragma once
#include <volk.h>

#include <cstdint>
#include <span>
#include <vector>

#include "engine/vulkan/handle.h"

namespace mote {

/// One value of `layout(constant_id = id)`; a float goes in as its bits.
struct SpecializationConstant {
  std::uint32_t id;
  std::uint32_t value;
};

/// Lives until the pipeline is made. Created by Device::createShaderModule.
class ShaderModule {
 public:
  ShaderModule() = default;
  VkShaderModule handle() const { return module_.get(); }

 private:
  friend class Device;
  DeviceHandle<VkShaderModule, &vkDestroyShaderModule> module_;
};

/// The constants in the shape Vulkan wants; refers to `constants`, which must stay where they are.
class SpecializationInfo {
 public:
  explicit SpecializationInfo(std::span<const SpecializationConstant> constants);
  const VkSpecializationInfo* get() const { return &info_; }

 private:
  std::vector<VkSpecializationMapEntry> entries_;
  VkSpecializationInfo info_{};
};

}  // namespace mote
