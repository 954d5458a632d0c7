// A file of particles in blocks, whatever its format, for what goes through a file once.
#pragma once
#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "host/particles/formats/particle_file.h"

namespace mote {

/// Of each requested channel, in order, the raw numbers of the next particles (Channel::bytes() each), and how many
/// particles; they hold until it returns.
using BlockTaker = std::function<void(std::span<const std::span<const std::byte>> columns, std::size_t count)>;

/// Reads the channels in one pass and hands all particles on, in the file's order. Throws as ParticleFile::read, and
/// what `take` throws; some blocks may have been taken by then. `take` runs on one thread at a time, but not always on
/// the same. Memory: a block of some hundred kB a channel where the format has its particles one behind the other;
/// where it has one channel behind the other (VTK), all channels but the last whole.
void readBlocks(const ParticleFile& file, std::span<const std::string> channels, const BlockTaker& take);

}  // namespace mote
