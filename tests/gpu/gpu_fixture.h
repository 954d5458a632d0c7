// A Vulkan device with validation and synchronization validation on, for every GPU test. No device, or any message of
// the layers, also about what is left over at the end, fails; nothing skips.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/vulkan/gpu.h"

namespace mote {

/// What new memory holds, so that a result shows what was read before it was written: floats of it are −1.7e38.
inline constexpr std::uint8_t kUnwritten = 0xfe;

/// Opened before the first test of the binary, closed after the last.
class GpuEnvironment : public ::testing::Environment {
 public:
  static GpuEnvironment& instance() { return *instance_; }
  Gpu& gpu() { return *gpu_; }

  void SetUp() override {
    try {
      gpu_.emplace(DeviceOptions{.validate = true, .fill = kUnwritten});
    } catch (const std::exception& error) {
      FAIL() << "GPU tests need a Vulkan device and the validation layer: " << error.what();
    }
  }

  void TearDown() override {
    if (!gpu_) return;
    const std::shared_ptr<const MessageLog> log = gpu_->instance().messageLog();
    gpu_.reset();  // the layers report what was not destroyed
    for (const std::string& message : log->messages()) ADD_FAILURE() << "validation: " << message;
  }

 private:
  std::optional<Gpu> gpu_;
  static GpuEnvironment* const instance_;
};

// GoogleTest owns it; made with the binary's static objects, so that no main of ours is needed.
inline GpuEnvironment* const GpuEnvironment::instance_ =
    static_cast<GpuEnvironment*>(::testing::AddGlobalTestEnvironment(new GpuEnvironment));

/// Base of GPU tests: device(), and a failure for each validation message that the test caused.
class GpuTest : public ::testing::Test {
 protected:
  Device& device() { return GpuEnvironment::instance().gpu().device(); }
  std::vector<std::string> messages() { return GpuEnvironment::instance().gpu().validationMessages(); }

  void SetUp() override { messagesBefore_ = messages().size(); }
  void TearDown() override {
    const std::vector<std::string> now = messages();
    for (std::size_t i = messagesBefore_; i < now.size(); ++i) ADD_FAILURE() << "validation: " << now[i];
  }

 private:
  std::size_t messagesBefore_ = 0;
};

}  // namespace mote
