// Which particles stand for all: a choice by a hash of their names.
#pragma once
#include <cstdint>
#include <span>

namespace mote {

/// True if the particle is in a sample of this fraction: by a hash of its id, so the same ones stay from frame to
/// frame, and every smaller fraction's are among a larger one's.
bool isSampled(std::uint64_t id, std::uint64_t seed, float fraction);

/// How many particles have a particle's ID, itself among them, in the mean over the particles: 1 where all differ, the
/// number of particles where they all share one; 0 for none. Sorts a copy.
double meanIdShare(std::span<const std::uint64_t> ids);

/// Particles of one ID are taken or left together, which spreads a sample's size by the root of how many they are. A
/// few sources that each count from 0 do no harm; a constant, or an emitter's number, would keep everything or nothing.
constexpr double kMostIdShare = 8;

}  // namespace mote
