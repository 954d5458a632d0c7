#include "engine/vulkan/instance.h"

#include <array>
#include <cstring>

#include "engine/vulkan/check.h"
#include "engine/vulkan/structure.h"
#include "host/core/error.h"

#if defined(__SANITIZE_ADDRESS__)
// Synchronization validation of the layer 1.3.239 keeps a cycle of its own objects for each submission, however command
// buffers and pools are reset or freed. What Mote leaks of Vulkan's objects the layers still report.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libVkLayer_khronos_validation.so\n"; }
#endif

namespace mote {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr const char* kWithoutVulkan = "install mesa-vulkan-drivers or use --lighting cpu --raster cpu";

VKAPI_ATTR VkBool32 VKAPI_CALL collect(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data, void* log) {
  static_cast<MessageLog*>(log)->add(data->pMessage);
  return VK_FALSE;  // the call that caused the message goes on
}

VkDebugUtilsMessengerCreateInfoEXT messengerInfo(MessageLog* log) {
  auto info = structure<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  info.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                     VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  info.pfnUserCallback = collect;
  info.pUserData = log;
  return info;
}

void loadLoader() {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (volkInitialize() != VK_SUCCESS)
    throw MachineError(fmt::format("no Vulkan loader (libvulkan.so.1): install libvulkan1; {}", kWithoutVulkan));
  const std::uint32_t version = volkGetInstanceVersion();
  if (version < VK_API_VERSION_1_3)
    throw MachineError(fmt::format("the Vulkan loader (libvulkan.so.1) is of version {}.{}, Mote needs 1.3; {}",
                                   VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version), kWithoutVulkan));
}

bool validationLayerInstalled() {
  std::uint32_t count = 0;
  vkCheck(vkEnumerateInstanceLayerProperties(&count, nullptr), "vkEnumerateInstanceLayerProperties");
  std::vector<VkLayerProperties> layers(count);
  vkCheck(vkEnumerateInstanceLayerProperties(&count, layers.data()), "vkEnumerateInstanceLayerProperties");
  for (const VkLayerProperties& layer : layers)
    if (std::strcmp(layer.layerName, kValidationLayer) == 0) return true;
  return false;
}

#if defined(__SANITIZE_ADDRESS__)
// With its last instance the loader unloads drivers and layers, and what those keep in static variables then looks
// leaked. An instance that is never destroyed keeps them loaded, in builds with the leak checker only.
void keepLibrariesLoaded(VkInstanceCreateInfo info) {
  static VkInstance kept = VK_NULL_HANDLE;
  info.pNext = nullptr;
  if (kept == VK_NULL_HANDLE) vkCreateInstance(&info, nullptr, &kept);
}
#else
void keepLibrariesLoaded(const VkInstanceCreateInfo&) {}
#endif

}  // namespace

void MessageLog::add(std::string message) {
  const std::lock_guard lock(mutex_);
  messages_.push_back(std::move(message));
}

std::vector<std::string> MessageLog::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

Instance::Instance(bool validate) {
  loadLoader();
  if (validate && !validationLayerInstalled())
    throw MachineError(fmt::format("the layer {} is not installed: install vulkan-validationlayers", kValidationLayer));

  auto application = structure<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.pApplicationName = "mote";
  application.apiVersion = VK_API_VERSION_1_3;

  constexpr std::array kEnabled{VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
  const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  const VkDebugUtilsMessengerCreateInfoEXT messenger = messengerInfo(log_.get());
  auto features = structure<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
  features.pNext = &messenger;  // vkCreateInstance and vkDestroyInstance are watched as well
  features.enabledValidationFeatureCount = static_cast<std::uint32_t>(kEnabled.size());
  features.pEnabledValidationFeatures = kEnabled.data();

  auto info = structure<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &application;
  if (validate) {
    info.pNext = &features;
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &kValidationLayer;
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &extension;
  }
  const VkResult result = vkCreateInstance(&info, nullptr, &instance_);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) throw MachineError(fmt::format("no Vulkan device; {}", kWithoutVulkan));
  vkCheck(result, "vkCreateInstance");
  keepLibrariesLoaded(info);
  volkLoadInstance(instance_);
  if (!validate) return;
  // Not volk's pointers: those become null as soon as an instance without the extension is loaded.
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
  destroyMessenger_ = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
  const VkResult watched = create(instance_, &messenger, nullptr, &messenger_);
  if (watched != VK_SUCCESS) {
    vkDestroyInstance(instance_, nullptr);
    vkCheck(watched, "vkCreateDebugUtilsMessengerEXT");
  }
}

Instance::~Instance() {
  if (messenger_ != VK_NULL_HANDLE) destroyMessenger_(instance_, messenger_, nullptr);
  vkDestroyInstance(instance_, nullptr);
}

}  // namespace mote
