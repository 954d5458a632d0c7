#include "host/core/random.h"

#include <cmath>

namespace mote {

dvec3 Random::direction() {
  const double z = uniform(-1, 1), angle = uniform(0, 2 * kPi), s = std::sqrt(std::max(0.0, 1 - z * z));
  return {s * std::cos(angle), s * std::sin(angle), z};
}

double Random::normal() {
  const double u = 1 - uniform(), v = uniform();  // u in (0, 1]: the logarithm stays finite
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * kPi * v);
}

}  // namespace mote
