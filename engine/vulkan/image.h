// A two-dimensional colour target.
#pragma once
#include <volk.h>

#include <cstdint>

#include "engine/vulkan/device_memory.h"
#include "engine/vulkan/handle.h"

namespace mote {

/// Device-local, one mip level, one sample; usable as colour attachment and as source and target of copies.
/// Created by Device::createImage.
class Image2D {
 public:
  Image2D() = default;
  VkImage handle() const { return image_.get(); }
  VkImageView view() const { return view_.get(); }
  VkFormat format() const { return format_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }

 private:
  friend class Device;
  DeviceMemory memory_;
  DeviceHandle<VkImage, &vkDestroyImage> image_;
  DeviceHandle<VkImageView, &vkDestroyImageView> view_;
  VkFormat format_ = VK_FORMAT_UNDEFINED;
  std::uint32_t width_ = 0, height_ = 0;
};

}  // namespace mote
