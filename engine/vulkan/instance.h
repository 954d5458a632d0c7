// The connection to the Vulkan loader, with the validation layer on request.
#pragma once
#include <volk.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace mote {

/// What the validation layer and the loader said, at severity warning or error. Outlives the instance, so that messages
/// of the destruction itself (leaks) are kept too. Safe from any thread.
class MessageLog {
 public:
  void add(std::string message);
  std::vector<std::string> messages() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> messages_;
};

/// A Vulkan 1.3 instance. Move-only by pointer: it stays where it was made, since the messenger points into it.
class Instance {
 public:
  /// `validate` turns on VK_LAYER_KHRONOS_validation with synchronization validation.
  /// Throws MachineError: no loader, no driver, a loader older than 1.3, no validation layer where it was asked for.
  explicit Instance(bool validate);
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  VkInstance handle() const { return instance_; }
  bool validates() const { return messenger_ != VK_NULL_HANDLE; }
  std::vector<std::string> validationMessages() const { return log_->messages(); }
  std::shared_ptr<const MessageLog> messageLog() const { return log_; }

 private:
  std::shared_ptr<MessageLog> log_ = std::make_shared<MessageLog>();
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  PFN_vkDestroyDebugUtilsMessengerEXT destroyMessenger_ = nullptr;
};

}  // namespace mote
