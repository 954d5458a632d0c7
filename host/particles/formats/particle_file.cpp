#include "host/particles/formats/particle_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/core/error.h"
#include "host/particles/formats/bgeo_reader.h"
#include "host/particles/formats/csv_reader.h"
#include "host/particles/formats/houdini_reader.h"
#include "host/particles/formats/hdf5_reader.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/nanovdb_reader.h"
#include "host/particles/formats/npy_reader.h"
#include "host/particles/formats/npz_reader.h"
#include "host/particles/formats/ply_reader.h"
#include "host/particles/formats/prt2_reader.h"
#include "host/particles/formats/prt_reader.h"
#include "host/particles/formats/vdb_reader.h"
#include "host/particles/formats/vtk_reader.h"
#include "host/particles/formats/vtk_xml_reader.h"

namespace mote {
namespace {

/// A format that is read. A new one is a file beside this one, and a line here.
struct Format {
  const char* name;  ///< for people
  /// Whether a file that begins so is of this format; at most kStart bytes are given.
  bool (*begins)(std::span<const std::byte> start);
  std::unique_ptr<ParticleFile> (*open)(const std::string& path, const VolumeSampling& sampling);
  bool packed = false;  ///< may be packed with gzip
  bool grids = false;   ///< holds grids with names
};

constexpr std::size_t kStart = 1 << 16;

template <class Reader>
std::unique_ptr<ParticleFile> open(const std::string& path, const VolumeSampling&) {
  return std::make_unique<Reader>(path);
}

constexpr Format kFormats[] = {
    {"PRT 1.0 and 1.1", beginsAsPrt, open<PrtReader>},
    {"PRT 2 and SPRT", beginsAsPrt2, open<Prt2Reader>},
    {"NPY", beginsAsNpy, open<NpyReader>},
    {"NPZ", beginsAsNpz, open<NpzReader>},
    {"PLY", beginsAsPly, open<PlyReader>},
    {"legacy VTK", beginsAsVtk, open<VtkReader>},
    {"VTK XML (VTU, VTP)", beginsAsVtkXml, open<VtkXmlReader>},
    {"classic BGEO", beginsAsBgeo, open<BgeoReader>, true},
    {"Houdini's GEO and BGEO", beginsAsHoudini, open<HoudiniReader>, true},
    {"HDF5 (GADGET-4, AREPO, SWIFT)", beginsAsHdf5, open<Hdf5Reader>},
    {"OpenVDB points and fog volumes", beginsAsVdb, openVdb, false, true},
    {"NanoVDB fog volumes", beginsAsNanoVdb, openNanoVdb, false, true},
    {"CSV and other tables of numbers", beginsAsTable, open<CsvReader>},  // last: any text might be one
};

/// What a file begins with, unpacked.
struct Start {
  std::vector<std::byte> bytes;
  bool packed = false;

  explicit Start(const std::string& path) : bytes(InputFile(path).start(kStart)), packed(beginsAsGzip(bytes)) {
    if (packed) bytes = unpackedStart(bytes, kStart);
  }
};

const Format* formatOf(const Start& start) {
  for (const Format& format : kFormats)
    if (format.begins(start.bytes)) return &format;
  return nullptr;
}

/// What is said of drawing particles must not be lost on a file that has its own.
void requireMeaning(const ParticleFile& file, bool grids, const VolumeSampling& sampling) {
  const auto refuse = [&](const char* field, const std::string& got) {
    throw InputError(file.path(), field,
                     fmt::format("none, as the file ({}) holds {} particles already", file.format(), file.count()), got,
                     fmt::format("\"{}\" is for volumes, which particles are drawn from", field));
  };
  if (sampling.count && !file.drawn()) refuse("count", fmt::format("{}", *sampling.count));
  if (sampling.seed != 0 && !file.drawn()) refuse("seed", fmt::format("{}", sampling.seed));
  if (!sampling.grid.empty() && !grids) refuse("grid", fmt::format("'{}'", sampling.grid));
}

}  // namespace

const Channel* ParticleFile::channel(std::string_view name) const {
  const auto found = std::find_if(channels_.begin(), channels_.end(), [&](const Channel& c) { return c.name == name; });
  return found == channels_.end() ? nullptr : &*found;
}

const Metadata* ParticleFile::meta(std::string_view channel, std::string_view name) const {
  const auto found = std::find_if(metadata_.begin(), metadata_.end(),
                                  [&](const Metadata& m) { return m.channel == channel && m.name == name; });
  return found == metadata_.end() ? nullptr : &*found;
}

std::string particleFormats() {
  std::string names;
  for (const Format& format : kFormats) names += (names.empty() ? "" : ", ") + std::string(format.name);
  return names;
}

bool isParticleFile(const std::string& path) { return formatOf(Start(path)) != nullptr; }

std::unique_ptr<ParticleFile> openParticleFile(const std::string& path, const VolumeSampling& sampling) {
  const Start start(path);
  const Format* format = formatOf(start);
  if (format && (format->packed || !start.packed)) {
    std::unique_ptr<ParticleFile> file = format->open(path, sampling);
    requireMeaning(*file, format->grids, sampling);
    return file;
  }
  if (format)
    throw InputError(path, "", fmt::format("{} as it is", format->name), "packed with gzip", "gunzip it first");
  throw InputError(path, "", fmt::format("a particle file in a format that Mote reads ({})", particleFormats()),
                   start.bytes.empty() ? "an empty file" : "none of them",
                   "numpy.save('particles.npy', array) with the columns x, y, z makes one that it does");
}

}  // namespace mote
