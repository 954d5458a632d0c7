#include "host/particles/formats/particle_writer.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/raw_vector.h"
#include "host/particles/formats/csv_writer.h"
#include "host/particles/formats/npy_writer.h"
#include "host/particles/formats/ply_writer.h"
#include "host/particles/formats/prt2_writer.h"
#include "host/particles/formats/prt_writer.h"

namespace mote {
namespace {

/// Rows that are put together at once: enough for all threads to share, little beside the particles.
constexpr std::size_t kSliceBytes = std::size_t{4} << 20;
constexpr std::size_t kGrain = 1 << 13;

/// A format that is written. A new one is a file beside this one, and a line here.
struct Format {
  OutputFormat format;
  std::string_view option, extension, name;
  Channel (*stored)(const Channel& channel);
  /// In place; false where the format cannot hold it. Null: it holds none.
  bool (*storeMetadata)(Metadata& value);
  std::unique_ptr<ParticleWriter> (*create)(const std::string& path, std::vector<Channel> channels,
                                            std::vector<Metadata> metadata, const WriteOptions& options);
};

template <class Writer>
std::unique_ptr<ParticleWriter> create(const std::string& path, std::vector<Channel> channels,
                                       std::vector<Metadata> metadata, const WriteOptions& options) {
  return std::make_unique<Writer>(path, std::move(channels), std::move(metadata), options);
}

constexpr Format kFormats[] = {
    {OutputFormat::Prt1, "prt", ".prt", "PRT 1.1", prtChannel, storePrtMetadata, create<PrtWriter>},
    {OutputFormat::Prt2, "prt2", "", "PRT 2", prt2Channel, storePrt2Metadata, create<Prt2Writer>},
    {OutputFormat::Ply, "ply", ".ply", "PLY", plyChannel, nullptr, create<PlyWriter>},
    {OutputFormat::Csv, "csv", ".csv", "CSV", csvChannel, nullptr, create<CsvWriter>},
    {OutputFormat::Npy, "npy", ".npy", "NPY", npyChannel, nullptr, create<NpyWriter>},
};

const Format& factsOf(OutputFormat format) {
  return *std::find_if(std::begin(kFormats), std::end(kFormats), [&](const Format& f) { return f.format == format; });
}

/// Computed from the particles, so another program's are out of date as soon as one particle is.
bool isBox(const Metadata& m) {
  return (m.channel.empty() && m.name == "BoundBox") || (m.channel == "Position" && m.name == "Extents");
}

}  // namespace

ParticleWriter::ParticleWriter(const std::string& path, std::vector<Channel> channels)
    : out_(path), channels_(std::move(channels)) {
  for (const Channel& c : channels_) {
    MOTE_CHECK(
        std::count_if(channels_.begin(), channels_.end(), [&](const Channel& other) { return other.name == c.name; }),
        ==, 1);
    offsets_.push_back(rowBytes_);
    rowBytes_ += c.bytes();
  }
  MOTE_CHECK(rowBytes_, >, 0u);
}

void ParticleWriter::write(std::span<const std::span<const std::byte>> columns) {
  MOTE_CHECK(columns.size(), ==, channels_.size());
  const std::size_t count = columns[0].size() / channels_[0].bytes();
  for (std::size_t k = 0; k < columns.size(); ++k) MOTE_CHECK(columns[k].size(), ==, count * channels_[k].bytes());
  const std::size_t perSlice = std::max<std::size_t>(1, kSliceBytes / rowBytes_);
  RawVector<std::byte> rows;
  // Isolated: blocks may come out of a reader's pipeline, whose other tasks must not start on top of this one.
  tbb::this_task_arena::isolate([&] {
    for (std::size_t first = 0; first < count; first += perSlice) {
      const std::size_t here = std::min(perSlice, count - first);
      rows.resize(here * rowBytes_);
      parallelBlocks(here, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = 0; k < columns.size(); ++k) {
          const std::size_t bytes = channels_[k].bytes();
          const std::byte* from = columns[k].data() + (first + begin) * bytes;
          std::byte* to = rows.data() + begin * rowBytes_ + offsets_[k];
          for (std::size_t i = begin; i < end; ++i, from += bytes, to += rowBytes_) std::memcpy(to, from, bytes);
        }
      });
      writeRows(rows, here);
      count_ += here;
    }
  });
}

void ParticleWriter::finish() {
  complete();
  out_.commit();
}

std::string_view formatName(OutputFormat format) { return factsOf(format).name; }

std::string outputFormatNames() {
  std::string names;
  for (const Format& f : kFormats) names += (names.empty() ? "" : ", ") + std::string(f.option);
  return names;
}

std::optional<OutputFormat> outputFormatNamed(std::string_view name) {
  for (const Format& f : kFormats)
    if (f.option == name) return f.format;
  return std::nullopt;
}

OutputFormat outputFormatOf(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string(), known;
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const Format& f : kFormats) {
    if (f.extension.empty()) continue;
    if (f.extension == extension) return f.format;
    known += (known.empty() ? "" : ", ") + std::string(f.extension);
  }
  throw InputError(path, "", "a name that ends in " + known, extension.empty() ? "none of them" : "'" + extension + "'",
                   fmt::format("or --format {}, whatever the name", outputFormatNames()));
}

Channel storedChannel(OutputFormat format, const Channel& channel) { return factsOf(format).stored(channel); }

std::vector<Metadata> storedMetadata(OutputFormat format, std::span<const Metadata> metadata,
                                     std::span<const Channel> channels, std::vector<std::string>& lost) {
  std::vector<Metadata> stored;
  for (Metadata m : metadata) {
    const auto own = [&](const Channel& c) { return c.name == m.channel; };
    if (isBox(m) || (!m.channel.empty() && std::none_of(channels.begin(), channels.end(), own))) continue;
    const std::string name = m.channel.empty() ? m.name : m.channel + "." + m.name;
    const auto store = factsOf(format).storeMetadata;
    if (store != nullptr && store(m))
      stored.push_back(std::move(m));
    else
      lost.push_back(name);
  }
  return stored;
}

std::unique_ptr<ParticleWriter> createParticleFile(OutputFormat format, const std::string& path,
                                                   std::vector<Channel> channels, std::vector<Metadata> metadata,
                                                   const WriteOptions& options) {
  if (options.text && format != OutputFormat::Ply && format != OutputFormat::Csv)
    throw InputError(path, "--ascii", "PLY or CSV", std::string(formatName(format)), "which has no text");
  if (!options.compression.empty() && format != OutputFormat::Prt2)
    throw InputError(path, "--compression", "PRT 2 (--format prt2)", std::string(formatName(format)),
                     "which has no choice of it");
  return factsOf(format).create(path, std::move(channels), std::move(metadata), options);
}

}  // namespace mote
