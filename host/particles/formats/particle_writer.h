// A file of particles that is being written, whatever its format: a header, then blocks of particles, whole or not at
// all.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/particles/formats/channel.h"
#include "host/particles/formats/output_stream.h"

namespace mote {

/// The formats that are written.
enum class OutputFormat { Prt1, Prt2, Ply, Csv, Npy };

/// What of a format can be chosen; what a format has not is refused by it.
struct WriteOptions {
  /// PRT 2: uncompressed, zlib, lz4, transpose, transpose-zlib, transpose-lz4. Empty: the format's own.
  std::string compression = {};
  bool text = false;  ///< PLY: text instead of little-endian binary
  /// zlib's 0 to 9; 1 M cloud particles: 1 gives 15.70 MB in 0.44 core-seconds, 6 gives 15.64 in 1.20.
  int level = 1;
};

class ParticleWriter {
 public:
  virtual ~ParticleWriter() = default;

  const std::string& path() const { return out_.path(); }
  const std::vector<Channel>& channels() const { return channels_; }
  std::uint64_t count() const { return count_; }  ///< particles so far
  std::uint64_t bytes() const { return out_.written(); }

  /// Adds particles behind those that are there: of each channel, in order, its raw numbers (little-endian,
  /// Channel::bytes() a particle), which need not be aligned. Throws MachineError where the disk refuses. The file's
  /// bytes depend neither on how particles are cut into blocks nor on the number of threads.
  void write(std::span<const std::span<const std::byte>> columns);
  /// Completes the file and puts it in its place. Call once. Without it (an exception, say) nothing is left behind.
  void finish();

 protected:
  ParticleWriter(const std::string& path, std::vector<Channel> channels);

  /// Particles one behind the other, each with its channels packed in order.
  virtual void writeRows(std::span<const std::byte> rows, std::size_t count) = 0;
  /// What stands behind the particles, and the counts in front of them.
  virtual void complete() = 0;

  OutputStream out_;
  std::vector<Channel> channels_;
  std::vector<std::size_t> offsets_;  ///< of the channels in a row [bytes]
  std::size_t rowBytes_ = 0;
  std::uint64_t count_ = 0;
};

/// "PRT 1.1", for people.
std::string_view formatName(OutputFormat format);
/// The format that a file's name ends in (.prt, .ply, .csv, .npy). Throws InputError, naming them, where it is none.
OutputFormat outputFormatOf(const std::string& path);
/// "prt", "prt2", "ply", "csv" or "npy".
std::optional<OutputFormat> outputFormatNamed(std::string_view name);
std::string outputFormatNames();

/// What a channel is in a file of the format: the same wherever the format can hold it. Else its name has '_' for what
/// cannot stand in one, and its type is the one that loses least:
///   PRT 1.x   Position is float32, as its makers' readers demand
///   PLY       float16 is float32 (lossless), 64-bit integers are float64 (exact up to 2^53)
/// and shares of integers (Channel::scale) are float32, but for PLY's colours of 8 and 16 bits.
Channel storedChannel(OutputFormat format, const Channel& channel);

/// The values that a file of the format can hold, in the way that it has them: PRT 1.x and 2 call some by other names.
/// Those that are made from the particles (their box) are left out, as the writer makes them anew; so are, silently,
/// those of channels that are not in `channels`. Names of all others are added to `lost`.
std::vector<Metadata> storedMetadata(OutputFormat format, std::span<const Metadata> metadata,
                                     std::span<const Channel> channels, std::vector<std::string>& lost);

/// Channels as storedChannel leaves them, of different names (checked: else a bug), metadata as storedMetadata does.
/// Throws InputError where the path cannot be written, or the format has not what the options ask for.
std::unique_ptr<ParticleWriter> createParticleFile(OutputFormat format, const std::string& path,
                                                   std::vector<Channel> channels, std::vector<Metadata> metadata,
                                                   const WriteOptions& options);

}  // namespace mote
