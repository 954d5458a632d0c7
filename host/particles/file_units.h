// What a file's numbers stand for: which axis points up, how long a unit is, what velocities are per.
#pragma once
#include <optional>
#include <string>

#include "host/core/vec.h"
#include "host/particles/formats/particle_file.h"
#include "host/scene/scene.h"

namespace mote {

/// What a file's metadata say, as PRT names them; other formats that know say it under these names.
struct FileMeaning {
  /// CoordSys: 1 and 2 are right-handed with y and z up, 3 and 4 left-handed; none: absent, or 0, unspecified.
  std::optional<int> axes;
  /// LengthUnitInMeters, or LengthUnitInMicrometers; none: absent.
  std::optional<double> metres;
};
FileMeaning meaningOf(const ParticleFile& file);

/// "right-handed, z up" of a CoordSys; empty where it is none.
std::string axesText(int coordSys);

/// What makes a file's numbers ours.
struct FileUnits {
  glm::dmat3 axes{1};   ///< exact: swaps and changes of sign
  double length = 1;    ///< scene units that a unit of the file is long
  double velocity = 1;  ///< factor on velocities beside `length`: frames a second, where they are per frame

  bool none() const { return axes == glm::dmat3(1) && length == 1; }  ///< apart from velocities
};

/// By the source's `up`, `unit` and `velocity_per`. Where the file says something that the scene leaves out, one line
/// of -v says so. Throws InputError where the scene leaves it to a file that does not say, or says nonsense.
FileUnits fileUnits(const ParticleSource& source, const ParticleFile& file, double framesPerSecond);

}  // namespace mote
