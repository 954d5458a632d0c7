// Particle sets made by Mote itself: for tests with known answers, and for pictures without a simulation at hand.
// Each is a function of (count, seed, frame): the same on any number of threads, any frame without those before it.
#pragma once
#include <cstdint>
#include <string_view>

#include "host/particles/particle_set.h"
#include "host/scene/scene.h"

namespace mote {

/// Frames a second of the plume's clock.
constexpr double kGeneratorFps = 24;

/// `count` ≥ 1 particles with position, radius, density (cross-section) and id; the plume has velocity too.
///   Ball   uniform in the unit ball about the origin; equal cross-sections 8π/(3N), so that the mean optical depth
///   along
///          a diameter is 4; radius 1.5 × the mean distance to the nearest 8 of a Poisson process of that density.
///          `frame` is unused.
///   Cloud  distributed after fractal noise inside [-1, 1]³, y up; see generate_cloud.cpp. `frame` is unused.
///   Plume  smoke rising from the origin to about y = 2 at time (frame − 1)/24 s; see generate_plume.cpp.
/// Throws InputError for a count of 0. Core-seconds, shared by the threads: 1 M ball 0.1, 1 M cloud 1.4, 350 k
/// plume 3.6.
ParticleSet generateParticles(Generator kind, std::uint64_t count, std::uint64_t seed, int frame);

ParticleSet generateBall(std::uint64_t count, std::uint64_t seed);
ParticleSet generateCloud(std::uint64_t count, std::uint64_t seed);
ParticleSet generatePlume(std::uint64_t count, std::uint64_t seed, int frame);

/// "ball", "cloud", "plume"; Generator::None for anything else.
Generator generatorNamed(std::string_view name);

}  // namespace mote
