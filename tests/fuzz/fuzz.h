// What the fuzz targets share: a file in memory, and what may come of reading it.
#pragma once
#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "host/particles/formats/particle_file.h"

namespace mote::fuzz {

/// What a target does with a file of any bytes; `bytes` is what the file at `path` holds. Each target has one.
void lookAt(const std::string& path, std::span<const std::byte> bytes);

/// Does it. An InputError that names the file, or one that it refers to, is as good as none; anything else that is
/// thrown is a finding.
void mayRefuse(const std::string& path, const std::function<void()>& action);

/// Reads every channel raw, at once and then in blocks, and checks that both give as many numbers as the file promises,
/// and what else particle_file.h promises.
void readRaw(const ParticleFile& file);

}  // namespace mote::fuzz
