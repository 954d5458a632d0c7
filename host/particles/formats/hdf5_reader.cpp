#include "host/particles/formats/hdf5_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <new>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/number_visit.h"
#include "host/particles/formats/section.h"
#include "host/particles/spacing.h"

namespace mote {
namespace {

constexpr std::uint64_t kMostFiles = 1 << 16;
constexpr std::string_view kTypes = "PartType";
/// Names that programs give positions; of these the root of a plain file has one.
constexpr std::string_view kPositions[] = {"Coordinates", "coordinates", "Position", "position", "Positions",
                                           "positions",   "pos",         "P",        "points"};
/// Support radius ÷ smoothing length of SWIFT's default kernel in three dimensions (Dehnen & Aly 2012, table 1).
constexpr double kCubicSplineGamma = 1.825742;
constexpr std::string_view kKernelGamma = "Kernel gamma";
constexpr std::string_view kSmoothing[] = {"SmoothingLengths", "SmoothingLength"};

const Hdf5Array* find(const std::vector<Hdf5Array>& arrays, std::string_view name) {
  const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const Hdf5Array& a) { return a.name == name; });
  return found == arrays.end() ? nullptr : &*found;
}

std::uint64_t rowsOf(const std::vector<Hdf5Array>& arrays, std::string_view name) {
  const Hdf5Array* array = find(arrays, name);
  return array ? array->rows : 0;
}

std::string shapeOf(const Hdf5Array& a) {
  return a.arity == 1 ? fmt::format("{} ({})", a.name, a.rows) : fmt::format("{} ({} × {})", a.name, a.rows, a.arity);
}

/// What the arrays are that there are, for messages; not all of them where there are many.
std::string shapesOf(const std::vector<Hdf5Array>& arrays) {
  constexpr std::size_t kMost = 20;
  std::string text;
  for (std::size_t k = 0; k < std::min(arrays.size(), kMost); ++k) text += (k > 0 ? ", " : "") + shapeOf(arrays[k]);
  return arrays.empty() ? "none" : text + (arrays.size() > kMost ? " …" : "");
}

bool isOfSwift(const ParticleFile& file) {
  const Metadata* code = file.meta("", "Code");
  return code && code->bytes.starts_with("SWIFT");
}

bool isDigits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

bool beginsAsHdf5(std::span<const std::byte> start) { return hdf5Begin(start) < start.size(); }

Hdf5Reader::Hdf5Reader(std::string path) : ParticleFile(std::move(path)) {
  const Hdf5File file(path_);
  for (const std::string_view name : {"Header", "Units", "Cosmology", "Parameters", "HydroScheme"}) {
    const Hdf5Group* group = file.group(std::string(name));
    if (!group) continue;
    for (const Metadata& entry : group->attributes) {
      const bool wanted = name == "Parameters"    ? entry.name.starts_with("Unit")
                          : name == "HydroScheme" ? entry.name == kKernelGamma
                                                  : true;
      if (wanted && !meta("", entry.name)) metadata_.push_back(entry);
    }
  }
  const bool snapshot = std::any_of(file.groups().begin(), file.groups().end(),
                                    [](const Hdf5Group& g) { return g.name.starts_with(kTypes); });
  if (snapshot || metaNumber("NumFilesPerSnapshot", 0) > 1)
    openSnapshot(file);
  else
    openPlain(file);
}

double Hdf5Reader::metaNumber(std::string_view name, std::size_t index) const {
  const Metadata* entry = meta("", name);
  if (!entry || entry->type == kMetadataText) return 0;
  return withNumberType(static_cast<NumberType>(entry->type), [&]<class T>(T number) {
    if ((index + 1) * sizeof(T) > entry->bytes.size()) return 0.0;
    std::memcpy(&number, entry->bytes.data() + index * sizeof(T), sizeof(T));
    return static_cast<double>(number);
  });
}

// ---- snapshots ----

/// All files of the snapshot, of which this is one: NAME.3.hdf5 of NAME.0.hdf5 …
std::vector<std::string> Hdf5Reader::partPaths() const {
  const double said = metaNumber("NumFilesPerSnapshot", 0);
  if (!(said > 1)) return {path_};
  const std::filesystem::path whole(path_);
  const std::string extension = whole.extension().string(), stem = whole.stem().string();
  const std::size_t dot = stem.rfind('.');
  if (said > static_cast<double>(kMostFiles) || dot == std::string::npos || !isDigits(stem.substr(dot + 1)))
    throw InputError(path_, "HDF5, NumFilesPerSnapshot",
                     fmt::format("a name like {}.0{}, as the snapshot has several files", stem, extension),
                     fmt::format("{} files", said), "give the files the names that the simulation gave them");
  std::vector<std::string> paths;
  std::string missing;
  std::error_code ignored;
  for (std::uint64_t k = 0; k < static_cast<std::uint64_t>(said); ++k) {
    const std::string name = fmt::format("{}.{}{}", stem.substr(0, dot), k, extension);
    paths.push_back((whole.parent_path() / name).string());
    constexpr std::size_t kMostShown = 200;  // characters
    if (std::filesystem::exists(paths.back(), ignored)) continue;
    if (missing.size() > kMostShown) {
      missing += " …";
      break;
    }
    missing += (missing.empty() ? "" : ", ") + name;
  }
  if (!missing.empty())
    throw InputError(path_, "HDF5, NumFilesPerSnapshot", fmt::format("{} files side by side", said), "no " + missing,
                     "a snapshot is read whole: put its other files beside this one");
  return paths;
}

void Hdf5Reader::openSnapshot(const Hdf5File& first) {
  std::vector<std::vector<Hdf5Group>> groups;  // of each file
  for (std::string& path : partPaths()) {
    groups.push_back(path == path_ ? first.groups() : Hdf5File(path).groups());
    parts_.push_back({std::move(path), {}});
  }
  chooseGroup(groups);
  for (std::size_t k = 0; k < parts_.size(); ++k)
    for (const Hdf5Group& group : groups[k])
      if (group.name == group_) parts_[k].arrays = group.arrays;
  format_ = fmt::format("HDF5{}, {}{}", isOfSwift(*this) ? " of SWIFT" : "", group_,
                        parts_.size() > 1 ? fmt::format(" in {} files", parts_.size()) : "");
  addArrays("Coordinates");
  addMasses();
  if (group_ == "PartType0") addRadius();
}

/// Gas, or else the only type of particles that there is.
void Hdf5Reader::chooseGroup(std::span<const std::vector<Hdf5Group>> files) {
  std::vector<std::pair<std::string, std::uint64_t>> types;
  for (const std::vector<Hdf5Group>& groups : files) {
    for (const Hdf5Group& group : groups) {
      if (!group.name.starts_with(kTypes) || !isDigits(group.name.substr(kTypes.size()))) continue;
      const std::uint64_t rows = rowsOf(group.arrays, "Coordinates");
      const auto known = std::find_if(types.begin(), types.end(), [&](const auto& t) { return t.first == group.name; });
      if (known == types.end())
        types.emplace_back(group.name, rows);
      else
        known->second += rows;
    }
  }
  std::sort(types.begin(), types.end());
  std::string counts;
  std::size_t filled = 0;
  for (const auto& [name, rows] : types) {
    counts += fmt::format("{}{} ({})", counts.empty() ? "" : ", ", name, rows);
    if (rows == 0) continue;
    ++filled;
    if (group_ != "PartType0") group_ = name;  // sorted: gas stays
  }
  if (filled == 0)
    throw InputError(path_, "HDF5", "a group like PartType0 with an array Coordinates",
                     counts.empty() ? "no PartType at all" : "no particles: " + counts);
  if (filled > 1 && group_ != "PartType0")
    throw InputError(path_, "HDF5", "gas (PartType0), or one type of particles alone", counts,
                     "make a file of the type that you want, with Python's h5py, or an NPY file");
}

/// Those that every file with particles has, of one type.
void Hdf5Reader::addArrays(const std::string& counted) {
  std::erase_if(parts_, [&](const Part& part) { return parts_.size() > 1 && rowsOf(part.arrays, counted) == 0; });
  for (const Part& part : parts_) {
    const Hdf5Array* position = find(part.arrays, counted);
    if (position && !position->otherFiles.empty())
      throw InputError(part.path, "HDF5, " + counted, "numbers in this file",
                       "those of " + position->otherFiles[0] + (position->otherFiles.size() > 1 ? " …" : ""),
                       "give that file: the others of its snapshot are found beside it");
    if (!position || !position->stored)
      throw InputError(part.path, fmt::format("HDF5, {}/{}", group_, counted), "numbers that the file holds",
                       position ? shapeOf(*position) : "none", "the file is cut off, or was never written to its end");
    if (position->rows > std::numeric_limits<std::uint64_t>::max() - count_)
      throw InputError(part.path, "HDF5, " + counted, "fewer rows", shapeOf(*position));
    count_ += position->rows;
  }
  for (const Hdf5Array& array : parts_[0].arrays) {
    std::string why;
    for (const Part& part : parts_) {
      const Hdf5Array* own = find(part.arrays, array.name);
      if (!own)
        why = "is not in all files";
      else if (own->rows != rowsOf(part.arrays, counted))
        why = fmt::format("has {} rows for {} particles", own->rows, rowsOf(part.arrays, counted));
      else if (own->type != array.type || own->arity != array.arity)
        why = "is of another type in " + part.path;
      else if (!own->stored)
        why = "has more numbers than the file holds";
      if (!why.empty()) break;
    }
    if (why.empty()) {
      const bool gasDensity = array.name == "Density" && group_ == "PartType0" &&
                              (find(parts_[0].arrays, "Masses") || metaNumber("MassTable", 0) > 0);
      addChannel({gasDensity ? "MassDensity" : array.name, array.type, array.arity},
                 {Source::Kind::Array, array.name, 0});
    } else if (array.name == counted) {
      throw InputError(path_, "HDF5, " + counted, "one type in all files", "it " + why);
    } else if (!group_.empty()) {
      logWarning(fmt::format("{}: left out {}, which {}", path_, array.name, why));
    }
  }
}

void Hdf5Reader::addChannel(Channel channel, Source source) {
  if (this->channel(channel.name)) return;
  channels_.push_back(std::move(channel));
  sources_.push_back(std::move(source));
}

void Hdf5Reader::addMasses() {
  const std::size_t type = group_.size() == kTypes.size() + 1 ? static_cast<std::size_t>(group_.back() - '0') : 0;
  const double mass = metaNumber("MassTable", type);
  if (mass > 0) addChannel({"Masses", NumberType::F64}, {Source::Kind::Constant, "", mass});
}

void Hdf5Reader::addRadius() {
  for (const std::string_view name : kSmoothing) {
    const Channel* smoothing = channel(name);
    if (!smoothing || smoothing->arity != 1) continue;
    double gamma = 1;
    if (meta("", kKernelGamma)) {
      gamma = metaNumber(kKernelGamma, 0);
    } else if (isOfSwift(*this)) {
      gamma = kCubicSplineGamma;
      logWarning(fmt::format(
          "{}: HydroScheme has no 'Kernel gamma': radii are {} smoothing lengths, as of a cubic spline", path_, gamma));
    }
    if (!(gamma >= 1) || !std::isfinite(gamma))  // the support is never shorter
      throw InputError(path_, "HDF5, HydroScheme, Kernel gamma", "a number ≥ 1", fmt::format("{}", gamma));
    Channel radius{"Radius", smoothing->type, 1, gamma};
    return addChannel(std::move(radius), {Source::Kind::Array, std::string(name), 0});
  }
  const bool density = channel("MassDensity") || channel("Densities");
  if (!density || !channel("Masses")) return;
  const std::size_t masses = static_cast<std::size_t>(channel("Masses") - channels_.data());
  addChannel({"Radius", NumberType::F64},
             {Source::Kind::Volume, channel("MassDensity") ? "Density" : "Densities", sources_[masses].constant});
}

// ---- plain files ----

void Hdf5Reader::openPlain(const Hdf5File& file) {
  parts_.push_back({path_, file.groups()[0].arrays});
  format_ = "HDF5";
  const std::vector<Hdf5Array>& arrays = parts_[0].arrays;
  const Hdf5Array* position = nullptr;
  for (const std::string_view name : kPositions)
    if (const Hdf5Array* array = find(arrays, name); array && array->arity >= 3 && !position) position = array;
  if (!position) {
    for (const Hdf5Array& array : arrays) {
      if (array.arity != 3) continue;
      if (position) {
        position = nullptr;
        break;
      }
      position = &array;
    }
  }
  if (!position) {
    std::string names;
    for (const Hdf5Group& group : std::span(file.groups()).subspan(1))
      names += (names.empty() ? "" : ", ") + group.name;
    throw InputError(path_, "HDF5", "groups like PartType0, or an array of positions (N × 3) in the root",
                     fmt::format("arrays {}; groups {}", shapesOf(arrays), names.empty() ? "none" : names),
                     "name it Coordinates, or make an NPY file of it with Python's h5py and numpy");
  }
  const std::string name = position->name;
  addArrays(name);
}

// ---- reading ----

void Hdf5Reader::readArray(const std::string& name, ChannelSink& sink) const {
  std::vector<std::byte> block;
  for (const Part& part : parts_) {
    const Hdf5Array& array = *find(part.arrays, name);
    const auto rows = hdf5Rows(part.path, group_, array);
    while (const std::size_t here = rows->next(block)) sink.append(block.data(), array.rowBytes(), here);
  }
}

std::vector<double> Hdf5Reader::numbers(const std::string& array) const {
  std::vector<double> values;
  const Channel own{array, find(parts_[0].arrays, array)->type, 1};
  ChannelSink sink(path_, {&own, 1}, {array, &values});
  readArray(array, sink);
  return values;
}

void Hdf5Reader::read(std::span<const ChannelRequest> requests) const {
  constexpr std::size_t kBlock = 1 << 16;
  try {
    for (const ChannelRequest& request : requests) {
      ChannelSink sink(path_, channels_, request);
      const Source& source = sources_[sink.index()];
      sink.reserve(std::min<std::uint64_t>(count_, 1 << 20));  // it may be packed in little: vectors grow
      if (source.kind == Source::Kind::Array) {
        readArray(source.array, sink);
        continue;
      }
      std::vector<double> values;
      if (source.kind == Source::Kind::Volume) {
        values = numbers(source.array);
        std::vector<double> masses;
        if (!(source.constant > 0)) masses = numbers("Masses");
        for (std::size_t i = 0; i < values.size(); ++i)
          values[i] = kAutoRadiusFactor * std::cbrt((masses.empty() ? source.constant : masses[i]) / values[i]);
      }
      const std::vector<double> same(values.empty() ? std::min<std::uint64_t>(count_, kBlock) : 0, source.constant);
      for (std::uint64_t first = 0; first < count_; first += kBlock) {
        const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, count_ - first));
        const double* from = values.empty() ? same.data() : values.data() + first;
        sink.append(reinterpret_cast<const std::byte*>(from), sizeof(double), here);
      }
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles", path_, count_));
  }
}

}  // namespace mote
