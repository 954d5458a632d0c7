#include "host/particles/file_units.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/number_visit.h"
#include "host/particles/loaded_source.h"

namespace mote {
namespace {

// Of CoordSys.
constexpr int kRightY = 1, kRightZ = 2, kLeftY = 3, kLeftZ = 4;

/// The first number of a value of the file; none where there is no such value, or it is a text.
std::optional<double> numberOf(const ParticleFile& file, const char* name) {
  const Metadata* meta = file.meta("", name);
  if (!meta || meta->type < 0 || meta->type >= kNumberTypes) return std::nullopt;
  return withNumberType(static_cast<NumberType>(meta->type), [&]<class T>(T value) -> std::optional<double> {
    if (meta->bytes.size() < sizeof value) return std::nullopt;
    std::memcpy(&value, meta->bytes.data(), sizeof value);
    return static_cast<double>(value);
  });
}

/// Rows are ours, columns the file's; ours are right-handed and y points up.
glm::dmat3 axesFrom(int coordSys) {
  const dvec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  switch (coordSys) {
    case kRightZ: return {x, -z, y};  // a turn: the file's y points away from the viewer
    case kLeftY: return {x, y, -z};
    case kLeftZ: return {x, z, y};
    default: return glm::dmat3(1);
  }
}

glm::dmat3 axesOf(const ParticleSource& source, const ParticleFile& file, const FileMeaning& meaning) {
  switch (source.up.value_or(UpAxis::Y)) {
    case UpAxis::Y: return axesFrom(kRightY);
    case UpAxis::Z: return axesFrom(kRightZ);
    case UpAxis::File: break;
  }
  if (meaning.axes) return axesFrom(*meaning.axes);
  throw InputError(scenePlace(source), "up", "a file whose metadata say which axis points up (CoordSys)",
                   fmt::format("{}, which does not", file.path()), R"(say "y" or "z")");
}

double lengthOf(const ParticleSource& source, const ParticleFile& file, const FileMeaning& meaning) {
  if (!source.unit) return 1;
  if (!source.unit->fromFile) return source.unit->metres;
  if (!meaning.metres)
    throw InputError(scenePlace(source), "unit", "a file whose metadata say how long a unit is (LengthUnitInMeters)",
                     fmt::format("{}, which does not", file.path()), "give the metres as a number");
  if (!(*meaning.metres > 0) || !std::isfinite(*meaning.metres))
    throw InputError(file.path(), "metadata LengthUnitInMeters", "a finite number > 0 [m]",
                     fmt::format("{}", *meaning.metres),
                     fmt::format(R"(give {} a "unit" in metres as a number)", scenePlace(source)));
  return *meaning.metres;
}

/// What the file says and the scene does not.
void sayWhatIsLeft(const ParticleSource& source, const ParticleFile& file, const FileMeaning& meaning) {
  std::string says, keys;
  const auto add = [](std::string& list, const std::string& more) { list += (list.empty() ? "" : ", ") + more; };
  if (!source.up && meaning.axes && *meaning.axes != kRightY)
    add(says, axesText(*meaning.axes)), add(keys, R"("up": "file")");
  if (!source.unit && meaning.metres && *meaning.metres != 1)
    add(says, fmt::format("a unit is {:g} m", *meaning.metres)), add(keys, R"("unit": "file")");
  if (!says.empty())
    logVerbose(fmt::format("{} says: {}; coordinates are taken as they are, {} at {} converts them", file.path(), says,
                           keys, scenePlace(source)));
}

}  // namespace

FileMeaning meaningOf(const ParticleFile& file) {
  FileMeaning meaning;
  if (const auto axes = numberOf(file, "CoordSys"); axes && *axes >= kRightY && *axes <= kLeftZ)
    meaning.axes = static_cast<int>(*axes);
  meaning.metres = numberOf(file, "LengthUnitInMeters");
  if (const auto micrometres = numberOf(file, "LengthUnitInMicrometers"); micrometres && !meaning.metres)
    meaning.metres = *micrometres * 1e-6;
  return meaning;
}

std::string axesText(int coordSys) {
  if (coordSys < kRightY || coordSys > kLeftZ) return "";
  const bool right = coordSys <= kRightZ, y = coordSys == kRightY || coordSys == kLeftY;
  return fmt::format("{}-handed, {} up", right ? "right" : "left", y ? "y" : "z");
}

FileUnits fileUnits(const ParticleSource& source, const ParticleFile& file, double framesPerSecond) {
  const FileMeaning meaning = meaningOf(file);
  sayWhatIsLeft(source, file, meaning);
  return {.axes = axesOf(source, file, meaning),
          .length = lengthOf(source, file, meaning),
          .velocity = source.velocityPer == VelocityTime::Frame ? framesPerSecond : 1};
}

}  // namespace mote
