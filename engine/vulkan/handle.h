// Owner of one Vulkan object that lives on a device: move-only, destroys what it holds.
#pragma once
#include <volk.h>

#include <utility>

namespace mote {

/// `Destroy` points to volk's function pointer, which is loaded at run time: DeviceHandle<VkBuffer, &vkDestroyBuffer>.
/// The device must outlive the handle. A null handle owns nothing, so a class may be filled object by object: what was
/// created before a later call throws is destroyed.
template <class T, auto Destroy>
class DeviceHandle {
 public:
  DeviceHandle() = default;
  explicit DeviceHandle(VkDevice device) : device_(device) {}
  DeviceHandle(DeviceHandle&& other) noexcept
      : device_(other.device_), handle_(std::exchange(other.handle_, VK_NULL_HANDLE)) {}
  DeviceHandle& operator=(DeviceHandle&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~DeviceHandle() {
    if (handle_ != VK_NULL_HANDLE) (*Destroy)(device_, handle_, nullptr);
  }

  VkDevice device() const { return device_; }
  T get() const { return handle_; }
  /// Where a vkCreate… call writes the handle; must be empty before.
  T* out() { return &handle_; }

 private:
  VkDevice device_ = VK_NULL_HANDLE;
  T handle_ = VK_NULL_HANDLE;
};

}  // namespace mote
