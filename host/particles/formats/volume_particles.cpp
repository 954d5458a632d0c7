#include "host/particles/formats/volume_particles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/formats/channel_sink.h"

namespace mote {
namespace {

constexpr std::uint64_t kBlock = 1 << 16;  // particles at a time: 2 MB, of all threads
constexpr std::size_t kGrain = 1 << 12;

/// A particle as ChannelSink takes it.
struct Row {
  double position[3];
  float density, radius;
  float velocity[3];
};

std::string listed(std::span<const std::string> names) {
  std::string all;
  for (const std::string& name : names) all += fmt::format("{}'{}'", all.empty() ? "" : ", ", name);
  return all;
}

Metadata whole(const char* name, std::uint64_t value) {
  Metadata number{"", name, static_cast<std::int32_t>(NumberType::U64), std::string(sizeof value, '\0')};
  std::memcpy(number.bytes.data(), &value, sizeof value);
  return number;
}

}  // namespace

std::size_t chosenGrid(const std::string& path, std::span<const std::string> names, const std::string& asked) {
  const std::string& wanted = asked.empty() ? "density" : asked;
  const auto found = std::find(names.begin(), names.end(), wanted);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  if (!asked.empty())
    throw InputError(path, "grid", "the name of a grid that can be made particles: " + listed(names),
                     fmt::format("'{}'", asked));
  if (names.size() == 1) return 0;
  throw InputError(path, "grid", "which of its grids is meant: " + listed(names), "nothing",
                   fmt::format("say it: \"grid\": \"{}\"", names.empty() ? "" : names[0]));
}

VolumeParticles::VolumeParticles(std::string path, Volume volume, VolumeExtras extras, const VolumeSampling& sampling)
    : ParticleFile(std::move(path)), volume_(std::move(volume)), velocity_(std::move(extras.velocity)) {
  format_ = std::move(extras.format);
  metadata_ = std::move(extras.metadata);
  const std::string field = fmt::format("grid '{}'", volume_.grid);
  const double integral = volume_.integral(), voxelVolume = volume_.voxelVolume();
  if (!(voxelVolume > 0) || !std::isfinite(voxelVolume))
    throw InputError(path_, field, "voxels with a volume", fmt::format("a transform that makes it {}", voxelVolume));
  if (volume_.dropped > 0)
    logWarning(fmt::format("{}: grid '{}': {} of {} active voxels are negative or not finite, counted as 0", path_,
                           volume_.grid, volume_.dropped, volume_.voxels));
  if (!(integral > 0))
    throw InputError(path_, field, "a density somewhere",
                     fmt::format("{} active voxels, none above 0", volume_.voxels));
  if (!(integral <= static_cast<double>(std::numeric_limits<float>::max())))
    throw InputError(path_, field, "an integral that float32 can say", fmt::format("{}", integral));
  if (sampling.count == 0u) throw InputError(path_, "count", "at least 1 particle", "0");
  count_ = sampling.count.value_or(std::min(volume_.held, kMostDefaultSamples));
  sampler_ = std::make_unique<VolumeSampler>(volume_, count_, sampling.seed);

  placed_.emplace_back("Position", NumberType::F64, 3, offsetof(Row, position));
  placed_.emplace_back("Density", NumberType::F32, 1, offsetof(Row, density));
  placed_.emplace_back("Radius", NumberType::F32, 1, offsetof(Row, radius));
  if (velocity_) placed_.emplace_back("Velocity", NumberType::F32, 3, offsetof(Row, velocity));
  for (const PlacedChannel& placed : placed_) channels_.push_back(placed.channel);
  metadata_.push_back(Metadata::text("", "grid", volume_.grid));
  metadata_.push_back(whole("active_voxels", volume_.voxels));
  metadata_.push_back(whole("tile_voxels", volume_.tileVoxels));
  metadata_.push_back(Metadata::float64("", "voxel_volume", voxelVolume));
  metadata_.push_back(Metadata::float64("", "integral", integral));
}

void VolumeParticles::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  const bool moving = velocity_ && std::any_of(requests.begin(), requests.end(),
                                               [](const ChannelRequest& r) { return r.channel == "Velocity"; });
  try {
    for (ChannelSink& sink : sinks) sink.reserve(count_);
    std::vector<VolumeSample> samples(static_cast<std::size_t>(std::min(kBlock, count_)));
    std::vector<vec3> velocities(moving ? samples.size() : 0);
    std::vector<Row> rows(samples.size());
    for (std::uint64_t first = 0; first < count_; first += kBlock) {
      const auto here = static_cast<std::size_t>(std::min(kBlock, count_ - first));
      sampler_->draw(first, std::span(samples).first(here));
      parallelBlocks(here, kGrain, [&](std::size_t begin, std::size_t end) {
        if (moving)
          velocity_(std::span(samples).subspan(begin, end - begin), std::span(velocities).subspan(begin, end - begin));
        for (std::size_t i = begin; i < end; ++i) {
          const VolumeSample& s = samples[i];
          const vec3 v = moving ? velocities[i] : vec3(0);
          rows[i] = {{s.position.x, s.position.y, s.position.z}, s.density, s.radius, {v.x, v.y, v.z}};
        }
      });
      const auto* raw = reinterpret_cast<const std::byte*>(rows.data());
      for (ChannelSink& sink : sinks) sink.append(raw + placed_[sink.index()].offset, sizeof(Row), here);
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles", path_, count_));
  }
}

}  // namespace mote
