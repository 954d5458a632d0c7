// A file of particles, whatever its format: what it holds, and a way to fill arrays from it.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/particles/formats/channel.h"
#include "host/particles/formats/volume_sampling.h"

namespace mote {

/// Opened: everything in front of the particles has been read and checked.
class ParticleFile {
 public:
  virtual ~ParticleFile() = default;

  const std::string& path() const { return path_; }
  /// "PRT 1.1", for people.
  const std::string& format() const { return format_; }
  std::uint64_t count() const { return count_; }
  /// In the file's order; names are unique and case-sensitive.
  const std::vector<Channel>& channels() const { return channels_; }
  /// Of the file and of its channels; (channel, name) is unique.
  const std::vector<Metadata>& metadata() const { return metadata_; }

  /// Null where the file has none of that name.
  const Channel* channel(std::string_view name) const;
  /// Null where there is none; channel "" is the file.
  const Metadata* meta(std::string_view channel, std::string_view name) const;

  /// Reads the particles, all of them, and fills the requested vectors; may be called again. Throws InputError where
  /// the file lacks a channel, its arity does not fit, or the data are truncated or damaged (naming the particle), and
  /// MachineError where memory runs out. The targets are then unspecified.
  virtual void read(std::span<const ChannelRequest> requests) const = 0;

  /// Whether its particles are drawn from a volume, so that count, seed and grid of VolumeSampling mean something.
  virtual bool drawn() const { return false; }

 protected:
  explicit ParticleFile(std::string path) : path_(std::move(path)) {}
  ParticleFile(ParticleFile&&) = default;

  std::string path_, format_;
  std::uint64_t count_ = 0;
  std::vector<Channel> channels_;
  std::vector<Metadata> metadata_;
};

/// Whether a file begins as one in a format that is read. Throws InputError where it cannot be read at all.
bool isParticleFile(const std::string& path);

/// "PRT 1.0 and 1.1, NPY", for messages.
std::string particleFormats();

/// Opens a file by its content, not by its name. Throws InputError: what is missing, not readable, damaged before the
/// first particle, or in none of the formats that are read; the last says which they are. `sampling` is for volumes; of
/// a file that holds points in several grids its `grid` says which. Throws InputError (field "count", "seed" or "grid")
/// where it asks something of a file that holds particles as they are.
std::unique_ptr<ParticleFile> openParticleFile(const std::string& path, const VolumeSampling& sampling = {});

}  // namespace mote
