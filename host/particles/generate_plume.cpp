// A smoke plume: particles leave a disc at the origin, hot; buoyancy lifts them against the drag of the air, which
// moves as PlumeFlow says. Each particle is followed from its birth to the frame's time, so a frame needs none before
// it.
#include <cmath>

#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/particles/generate.h"
#include "host/particles/noise.h"
#include "host/particles/plume_flow.h"
#include "host/particles/spacing.h"

namespace mote {
namespace {

constexpr double kLifetime = 4.4;     // [s]; the rise to the umbrella takes about 2
constexpr float kSourceDisc = 0.1f;   // radius of the disc [units]
constexpr float kDragTime = 0.06f;    // in which a particle takes on the air's velocity [s]
constexpr float kBuoyancy = 2.0f;     // acceleration of fresh smoke [units/s²]
constexpr float kCoolingTime = 0.8f;  // [s]
// Optical depth across the column near its base, and the mean speed and width there that it is computed with.
constexpr double kBaseOpticalDepth = 7, kBaseSpeed = 1.0;
constexpr float kDissipationTime = 3.5f;  // [s]
constexpr float kRadiusGrowth = 0.55f;    // [1/s]: as the column widens, so does the spacing

struct Smoke {
  vec3 position, velocity;
  vec3 pull;  ///< what drag pulled it towards at the end of the last step
  float age;  ///< [s]
};

/// The velocity that drag pulls a particle towards: the air's, and the speed at which buoyancy and drag are in balance.
vec3 target(const PlumeFlow& flow, const vec3& p, int step, float age) {
  return flow.velocity(p, step) + vec3(0, kBuoyancy * kDragTime * std::exp(-age / kCoolingTime), 0);
}

Smoke born(const PlumeFlow& flow, std::uint64_t seed, std::int64_t index, int step) {
  Random random(seed, static_cast<std::uint64_t>(index));
  const double angle = random.uniform(0, 2 * kPi), distance = kSourceDisc * std::sqrt(random.uniform());
  Smoke s;
  s.position = vec3(distance * std::cos(angle), 0.02 * random.uniform(), distance * std::sin(angle));
  s.pull = target(flow, s.position, step, 0);
  s.velocity = s.pull;
  s.age = 0;
  return s;
}

/// One step of x′ = v, v′ = (c(x, t) − v) / drag time to the flow's step `to`: predict, evaluate c there, correct.
/// Second order in x and exact for the stiff drag term, at one evaluation of the flow a step.
void advance(const PlumeFlow& flow, int to, float dt, Smoke& s) {
  const float decay = std::exp(-dt / kDragTime),
              share = (1 - decay) * kDragTime / dt;  // of the old velocity: at the end, on average
  const vec3 guess = s.position + dt * (s.pull + share * (s.velocity - s.pull));
  s.age += dt;
  const vec3 pull = target(flow, guess, to, s.age), mean = 0.5f * (s.pull + pull);
  s.position += dt * (mean + share * (s.velocity - mean));
  s.velocity = mean + decay * (s.velocity - mean);
  s.pull = pull;
}

/// The flow's step at or before a time.
int stepBefore(double time) { return static_cast<int>(std::floor(time / kPlumeStep)); }

/// `count` particles, born at (first + i) × interval, at step `last`. A step at a time for all of them: neighbours in
/// age are neighbours in space and share the flow's cells in cache.
std::vector<Smoke> follow(const PlumeFlow& flow, std::uint64_t seed, std::int64_t first, std::size_t count,
                          double interval, int last) {
  std::vector<Smoke> smoke(count);
  const auto birthOf = [&](std::size_t i) {
    return static_cast<double>(first + static_cast<std::int64_t>(i)) * interval;
  };
  const auto start = [&](std::size_t i, int step) {
    smoke[i] = born(flow, seed, first + static_cast<std::int64_t>(i), step);
  };
  std::size_t alive = 0;
  for (int step = stepBefore(birthOf(0)); step < last; ++step) {
    const std::size_t grown = alive;
    for (; alive < count && stepBefore(birthOf(alive)) == step; ++alive) start(alive, step);
    for (std::size_t i = 0; i < alive; ++i) {
      // The first step of a particle is what is left of the one that it is born in.
      const double dt = i < grown ? kPlumeStep : (step + 1) * kPlumeStep - birthOf(i);
      if (dt > 1e-6) advance(flow, step + 1, static_cast<float>(dt), smoke[i]);
    }
  }
  for (; alive < count; ++alive) start(alive, last);
  return smoke;
}

}  // namespace

ParticleSet generatePlume(std::uint64_t count, std::uint64_t seed, int frame) {
  // Birth k is at time k · lifetime / count, whatever the frame: k is the id. Before time 0 it has been going on
  // forever.
  const int last = frame - 1 + static_cast<int>(kLifetime / kPlumeStep) + 1;
  const double now = last * kPlumeStep, interval = kLifetime / static_cast<double>(count);
  const auto newest = static_cast<std::int64_t>(std::floor(now / interval));
  const PlumeFlow flow(seed, last - static_cast<int>(kLifetime / kPlumeStep) - 2, last);

  // Particles a unit³ at the source: what leaves in a second over the volume that it fills.
  const double n =
      1 / interval / (kBaseSpeed * kPi * static_cast<double>(kSourceDisc) * static_cast<double>(kSourceDisc));
  const auto firstRadius = static_cast<float>(kAutoRadiusFactor * poissonNeighbourDistance(n));
  // Optical depth across: cross-section · particles a unit of height / width.
  const auto firstDensity =
      static_cast<float>(kBaseOpticalDepth * 2 * static_cast<double>(kSourceDisc) * kBaseSpeed * interval);

  ParticleSet set;
  set.position.resize(count);
  set.velocity.resize(count);
  set.radius.resize(count);
  set.density.resize(count);
  set.id.resize(count);
  const std::int64_t oldest = newest - static_cast<std::int64_t>(count) + 1;
  parallelBlocks(count, 1 << 11, [&](std::size_t begin, std::size_t end) {
    const std::int64_t first = oldest + static_cast<std::int64_t>(begin);
    const std::vector<Smoke> smoke = follow(flow, seed, first, end - begin, interval, last);
    for (std::size_t i = begin; i < end; ++i) {
      const std::int64_t index = first + static_cast<std::int64_t>(i - begin);
      const Smoke& s = smoke[i - begin];
      const auto age = static_cast<float>(now - static_cast<double>(index) * interval),
                 spent = age / static_cast<float>(kLifetime);
      set.position[i] = s.position;
      set.velocity[i] = s.velocity;
      set.radius[i] = firstRadius * (1 + kRadiusGrowth * age);
      // Fades to nothing at the end of its life, so that no particle pops out of the picture.
      set.density[i] = firstDensity * std::exp(-age / kDissipationTime) * (1 - smoothStep(0.6f, 1, spent));
      set.id[i] = static_cast<std::uint64_t>(index);
    }
  });
  return set;
}

}  // namespace mote
