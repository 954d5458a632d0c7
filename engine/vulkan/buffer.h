// Memory that shaders reach by its device address.
#pragma once
#include <volk.h>

#include <cstddef>
#include <span>

#include "engine/vulkan/device_memory.h"
#include "engine/vulkan/handle.h"
#include "host/core/error.h"

namespace mote {

/// Where a buffer lives.
enum class Memory {
  Device,  // device-local: for everything that shaders work on; mapped only where the device's memory is the host's
  Host,    // host-visible, coherent and always mapped: staging and small results
};

/// One array on the device, with an allocation of its own (Mote has tens of buffers, never thousands). Made by
/// Device::createBuffer, which must outlive it. Usable as storage (by address), index, vertex, indirect, transfer.
/// Passing it by address() is not limited by maxStorageBufferRange (128 MiB on lavapipe).
class Buffer {
 public:
  Buffer() = default;  // owns nothing; size 0, address 0

  VkDeviceSize size() const { return size_; }  // bytes asked for
  VkDeviceAddress address() const { return address_; }
  VkBuffer handle() const { return buffer_.get(); }
  bool mapped() const { return data_ != nullptr; }

  /// The whole buffer as elements of T; only where mapped(). Writes are visible to what is submitted later, reads see
  /// what a finished submission wrote.
  template <class T>
  std::span<T> map() const {
    MOTE_CHECK(mapped(), ==, true);
    return {static_cast<T*>(data_), static_cast<std::size_t>(size_) / sizeof(T)};
  }

 private:
  friend class Device;
  // Destroyed from the last to the first: the buffer before the memory it is bound to.
  DeviceMemory memory_;
  DeviceHandle<VkBuffer, &vkDestroyBuffer> buffer_;
  VkDeviceSize size_ = 0;
  VkDeviceAddress address_ = 0;
  void* data_ = nullptr;
};

}  // namespace mote
