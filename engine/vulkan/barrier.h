// Memory barriers by name: who wrote, who reads next.
#pragma once
#include <volk.h>

namespace mote {

/// A global memory barrier (synchronization2): what the first half wrote is visible to the second half. It also orders
/// reads before later writes, since the first half's execution ends before the second's begins.
struct Barrier {
  VkPipelineStageFlags2 fromStage;
  VkAccessFlags2 fromAccess;
  VkPipelineStageFlags2 toStage;
  VkAccessFlags2 toAccess;
};

namespace barrier {

inline constexpr VkAccessFlags2 kShaderReadWrite =
    VK_ACCESS_2_SHADER_STORAGE_READ_BIT | VK_ACCESS_2_SHADER_SAMPLED_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT;
inline constexpr VkPipelineStageFlags2 kDrawShaders = VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT |
                                                      VK_PIPELINE_STAGE_2_GEOMETRY_SHADER_BIT |
                                                      VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT;

inline constexpr Barrier computeToCompute{VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, kShaderReadWrite,
                                          VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, kShaderReadWrite};
inline constexpr Barrier computeToTransfer{VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, kShaderReadWrite,
                                           VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                           VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT};
inline constexpr Barrier computeToHost{VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT,
                                       VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT};
/// Compute wrote indices, and arrays that draw shaders pull from.
inline constexpr Barrier computeToIndexAndVertexInput{VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                                                      VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT,
                                                      VK_PIPELINE_STAGE_2_INDEX_INPUT_BIT | kDrawShaders,
                                                      VK_ACCESS_2_INDEX_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_READ_BIT};
inline constexpr Barrier transferToCompute{VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                           VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT,
                                           VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, kShaderReadWrite};
inline constexpr Barrier transferToIndexAndVertexInput{
    VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
    VK_PIPELINE_STAGE_2_INDEX_INPUT_BIT | kDrawShaders,
    VK_ACCESS_2_INDEX_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_READ_BIT};
inline constexpr Barrier transferToTransfer{
    VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT,
    VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT};
inline constexpr Barrier transferToHost{VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                                        VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT};
/// Compute and copies before, compute and copies after.
inline constexpr Barrier workToWork{VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                    kShaderReadWrite | VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT,
                                    VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                    kShaderReadWrite | VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT};
/// Draws read an array; compute or a copy writes it next.
inline constexpr Barrier drawToCompute{VK_PIPELINE_STAGE_2_INDEX_INPUT_BIT | kDrawShaders, VK_ACCESS_2_NONE,
                                       VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, kShaderReadWrite};
/// Everything before, for the host: what CommandBuffer ends with.
inline constexpr Barrier allToHost{VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_MEMORY_WRITE_BIT,
                                   VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT};

}  // namespace barrier
}  // namespace mote
