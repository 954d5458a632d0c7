// From a file's own coordinates and sizes to the scene's.
#pragma once
#include <limits>

#include "host/particles/loaded_source.h"

namespace mote {

/// Rz · Ry · Rx: x is applied first. `degrees` about each axis.
glm::dmat3 rotationAbout(const dvec3& degrees);

/// Gives every particle a radius by the source's rule, in the file's own units: a number, a channel times a factor, or
/// for Auto the channel where there is one, else 1.5 × meanNeighbourDistance for all of the source. Throws InputError
/// where there is no spacing to take a radius from.
void applyRadiusRule(const ParticleSource& source, LoadedSource& loaded);

/// How a source's numbers become the scene's: the file's axes and unit, then the source's scale, rotate about x, y, z
/// and translate. In double throughout.
struct Placement {
  glm::dmat3 linear{1};  ///< of positions, and of velocities beside their own factor
  dvec3 shift{0};        ///< where what the positions are measured from comes to lie
  double scale = 1;      ///< of radii, whatever their rule
  double area = 1;       ///< of cross-sections; in mode Peak densities stay
  double velocity = 1;
  bool stays = true;  ///< linear is 1: numbers stay to the last bit
};
Placement placementOf(const ParticleSource& source, DensityMode mode, const LoadedSource& loaded);

/// Of the centres in the scene, measured from its own 0; empty (lo > hi) for no particles.
struct SceneBox {
  dvec3 lo{std::numeric_limits<double>::infinity()}, hi{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(lo.x <= hi.x); }
  void add(const SceneBox& other) { lo = glm::min(lo, other.lo), hi = glm::max(hi, other.hi); }
};
SceneBox sceneBox(const LoadedSource& loaded, const Placement& place);

/// Places the particles, measured from `origin`; colour, absorption and emission stay.
void moveIntoScene(const Placement& place, const dvec3& origin, LoadedSource& loaded);

}  // namespace mote
