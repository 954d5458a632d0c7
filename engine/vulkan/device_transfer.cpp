// Device: submission, and copies between the host and buffers.
#include <algorithm>
#include <cstring>

#include "engine/vulkan/check.h"
#include "engine/vulkan/device.h"
#include "engine/vulkan/structure.h"
#include "host/core/error.h"

namespace mote {
namespace {

constexpr std::uint64_t kStagingBytes = 64u << 20;       // enough to hide a submission's cost, small beside any heap
constexpr std::uint64_t kLeastStagingBytes = 64u << 10;  // where the budget has no more

}  // namespace

CommandBuffer Device::beginCommands() const { return CommandBuffer(device_, pool_); }

void Device::submitAndWait(CommandBuffer commands) const {
  commands.barrier(barrier::allToHost);
  vkCheck(vkEndCommandBuffer(commands.handle()), "vkEndCommandBuffer");

  DeviceHandle<VkFence, &vkDestroyFence> fence(device_);
  const auto fenceInfo = structure<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  vkCheck(vkCreateFence(device_, &fenceInfo, nullptr, fence.out()), "vkCreateFence");
  auto buffer = structure<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
  buffer.commandBuffer = commands.handle();
  auto submit = structure<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
  submit.commandBufferInfoCount = 1;
  submit.pCommandBufferInfos = &buffer;
  VkResult result = fault(DeviceCall::Submit);
  if (result == VK_SUCCESS) result = vkQueueSubmit2(queue_, 1, &submit, fence.get());
  vkCheck(result, "vkQueueSubmit2");
  const VkFence waited = fence.get();
  result = vkWaitForFences(device_, 1, &waited, VK_TRUE, ~0ull);
  if (result == VK_SUCCESS) result = fault(DeviceCall::Wait);  // nothing is under way any more
  vkCheck(result, "vkWaitForFences", fmt::format("on {}", name()));
}

void Device::run(const std::function<void(CommandBuffer&)>& record) const {
  CommandBuffer commands = beginCommands();
  record(commands);
  submitAndWait(std::move(commands));
}

std::uint64_t Device::stagingCost() const {
  const std::uint32_t type = memoryType(~0u, Memory::Device);
  return isMapped(type, Memory::Device) ? 0 : bufferCost(kLeastStagingBytes, Memory::Host);
}

Buffer Device::stagingBuffer(std::uint64_t bytes) const {
  std::uint64_t part = std::min(bytes, kStagingBytes);
  while (part > kLeastStagingBytes && bufferCost(part, Memory::Host) > budget_.room())
    part = std::max(part / 2, kLeastStagingBytes);
  return createBuffer(part, Memory::Host);
}

void Device::uploadBytes(const Buffer& to, VkDeviceSize offset, const void* data, std::size_t bytes) const {
  MOTE_CHECK(offset + bytes, <=, to.size());
  if (bytes == 0) return;
  if (to.mapped()) {
    std::memcpy(to.map<std::byte>().data() + offset, data, bytes);
    return;
  }
  const Buffer staging = stagingBuffer(bytes);
  for (std::uint64_t done = 0; done < bytes; done += staging.size()) {
    const std::uint64_t part = std::min<std::uint64_t>(bytes - done, staging.size());
    std::memcpy(staging.map<std::byte>().data(), static_cast<const std::byte*>(data) + done, part);
    run([&](CommandBuffer& commands) { commands.copy(staging, 0, to, offset + done, part); });
  }
}

void Device::downloadBytes(const Buffer& from, VkDeviceSize offset, void* data, std::size_t bytes) const {
  MOTE_CHECK(offset + bytes, <=, from.size());
  if (bytes == 0) return;
  if (from.mapped()) {
    std::memcpy(data, from.map<std::byte>().data() + offset, bytes);
    return;
  }
  const Buffer staging = stagingBuffer(bytes);
  for (std::uint64_t done = 0; done < bytes; done += staging.size()) {
    const std::uint64_t part = std::min<std::uint64_t>(bytes - done, staging.size());
    run([&](CommandBuffer& commands) { commands.copy(from, offset + done, staging, 0, part); });
    std::memcpy(static_cast<std::byte*>(data) + done, staging.map<std::byte>().data(), part);
  }
}

}  // namespace mote
