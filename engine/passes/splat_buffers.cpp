#include "engine/passes/splat_buffers.h"

#include <algorithm>

#include "host/core/parallel.h"

namespace mote {
namespace {

constexpr std::size_t kPiece = 1 << 20;  // gathered at a time: no second copy of all on the host

template <class T>
void gather(const Device& device, const std::vector<T>& from, std::span<const layout::uint> order, const Buffer& to) {
  if (from.empty()) return;
  std::vector<T> piece;
  for (std::size_t begin = 0; begin < order.size(); begin += kPiece) {
    piece.resize(std::min(kPiece, order.size() - begin));
    parallelBlocks(piece.size(), 1 << 14, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) piece[i] = from[order[begin + i]];
    });
    device.upload<T>(to, piece, begin);
  }
}

template <class T>
void uploadAll(const Device& device, const std::vector<T>& from, const Buffer& to) {
  if (!from.empty()) device.upload<T>(to, from);
}

}  // namespace

SplatBuffers::SplatBuffers(const Device& device, const SplatSet& set, std::uint64_t count)
    : particles(device.createBuffer(count * sizeof(layout::SplatParticle))) {
  if (!set.extinction.empty()) extinction = device.createBuffer(count * sizeof(vec3));
  if (!set.emission.empty()) emission = device.createBuffer(count * sizeof(vec3));
  if (!set.velocity.empty()) velocity = device.createBuffer(count * sizeof(vec3));
}

std::vector<std::uint64_t> SplatBuffers::sizes(const SplatSet& set, std::uint64_t count) {
  std::vector<std::uint64_t> sizes{count * sizeof(layout::SplatParticle)};
  for (const std::vector<vec3>* array : {&set.extinction, &set.emission, &set.velocity})
    if (!array->empty()) sizes.push_back(count * sizeof(vec3));
  return sizes;
}

void SplatBuffers::upload(const Device& device, const SplatSet& set) const {
  uploadAll(device, set.particles, particles);
  uploadAll(device, set.extinction, extinction);
  uploadAll(device, set.emission, emission);
  uploadAll(device, set.velocity, velocity);
}

void SplatBuffers::upload(const Device& device, const SplatSet& set, std::span<const layout::uint> order) const {
  gather(device, set.particles, order, particles);
  gather(device, set.extinction, order, extinction);
  gather(device, set.emission, order, emission);
  gather(device, set.velocity, order, velocity);
}

}  // namespace mote
