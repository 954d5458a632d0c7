// What a conversion makes of its inputs' channels and metadata, before any particle is read (used by conversion.cpp).
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/particles/conversion.h"

namespace mote {

struct PlannedChannel {
  WrittenChannel written;
  std::string ours;                             ///< which of our channels it is; empty: none
  std::vector<std::optional<Channel>> sources;  ///< of each input
};

struct ConversionPlan {
  std::vector<PlannedChannel> channels;
  std::vector<Metadata> metadata;  ///< as the format has it
  std::vector<std::string> lostMetadata, notes;
};

/// Throws InputError as convertParticles.
ConversionPlan planConversion(std::span<const std::unique_ptr<ParticleFile>> inputs, const std::string& path,
                              const ConversionOptions& options);

}  // namespace mote
