#include "engine/vulkan/shader_module.h"

#include <cstddef>

namespace mote {

SpecializationInfo::SpecializationInfo(std::span<const SpecializationConstant> constants) {
  for (std::size_t i = 0; i < constants.size(); ++i) {
    const std::size_t offset = i * sizeof(SpecializationConstant) + offsetof(SpecializationConstant, value);
    entries_.push_back({constants[i].id, static_cast<std::uint32_t>(offset), sizeof(std::uint32_t)});
  }
  info_.mapEntryCount = static_cast<std::uint32_t>(entries_.size());
  info_.pMapEntries = entries_.data();
  info_.dataSize = constants.size_bytes();
  info_.pData = constants.data();
}

}  // namespace mote
