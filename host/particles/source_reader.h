// One source's particles as they are in its file, or as a generator makes them.
#pragma once
#include "host/particles/loaded_source.h"

namespace mote {

/// Motion: Position, Velocity and ID only.
enum class SourceChannels { All, Motion };

/// Reads the channels that are ours under whatever names the file has for them; where it has no Density the source's
/// `density` holds. Positions of types wider than float32 (doubles, 32-bit integers) are read as doubles, and measured
/// from `LoadedSource::centre` where they lie far from the origin. Nothing is checked but that the channels are there
/// and of the right arity. Throws InputError as openParticleFile and ParticleFile::read do; for a missing file (with
/// the nearest names or frames that exist), and for a channel that the file lacks (with those it has).
LoadedSource readSource(const ParticleSource& source, const std::string& path, double framesPerSecond,
                        SourceChannels channels = SourceChannels::All);

/// Throws InputError where the radius is to come from a channel that generated particles do not have.
LoadedSource generateSource(const ParticleSource& source, int frame);

}  // namespace mote
