#include "host/particles/formats/vdb_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/core/error.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

constexpr unsigned char kMagic[] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};
constexpr std::uint32_t kLeastVersion = 222, kMostVersion = 224;
constexpr std::size_t kUuidBytes = 36;
constexpr std::uint32_t kMostText = 1 << 16;  // of names and types; OpenVDB has no limit
constexpr char kSuffixMark = 0x1e;            // parts a name from the number that makes it unique
constexpr std::string_view kHalfSuffix = "_HalfFloat";

std::string text(const std::string& path, Section& section, const char* what) {
  const auto size = section.number<std::uint32_t>(what);
  if (size > kMostText)
    throw InputError(path, what, fmt::format("at most {} bytes", kMostText), fmt::format("{}", size),
                     "the file is damaged");
  return section.bytes(size, what);
}

/// Name, type and value of each; `take` gets those of a known meaning.
template <class Take>
void readMetadata(const std::string& path, Section& section, const Take& take) {
  const auto count = section.number<std::uint32_t>("number of metadata");
  for (std::uint32_t k = 0; k < count; ++k) {  // each takes 12 bytes at least
    const std::string name = text(path, section, "a metadatum's name");
    text(path, section, "a metadatum's type");
    const auto size = section.number<std::uint32_t>("a metadatum's size");
    if (size > section.left())
      throw InputError(path, fmt::format("metadatum {}", shown(name)), fmt::format("at most {} bytes", section.left()),
                       fmt::format("{}", size), "the file is cut off or damaged");
    if (name == "class" && size <= kMostText) {
      take(section.bytes(size, "a grid's class"));
    } else {
      section.skip(size);
    }
  }
}

dvec3 vector(Section& section) {
  dvec3 v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = section.number<double>("a grid's transform");
  return v;
}

void readTransform(const std::string& path, Section& section, VdbGrid& grid) {
  const std::string type = text(path, section, "a transform's type");
  grid.affine = true;
  const auto scaled = [&] {
    const dvec3 scale = vector(section);
    for (int axis = 0; axis < 3; ++axis) grid.linear[axis][axis] = scale[axis];
    for (int k = 0; k < 4; ++k) vector(section);  // voxel size and what is derived from it
  };
  if (type == "AffineMap" || type == "UnitaryMap") {
    double m[16];  // rows; row vectors are multiplied from the left: the last row is the translation
    for (double& number : m) number = section.number<double>("a grid's transform");
    for (int row = 0; row < 3; ++row)
      for (int c = 0; c < 3; ++c) grid.linear[row][c] = m[4 * row + c];  // glm: columns
    grid.translate = dvec3(m[12], m[13], m[14]);
  } else if (type == "ScaleMap" || type == "UniformScaleMap") {
    scaled();
  } else if (type == "ScaleTranslateMap" || type == "UniformScaleTranslateMap") {
    grid.translate = vector(section);
    scaled();
  } else if (type == "TranslationMap") {
    grid.translate = vector(section);
  } else if (type == "NonlinearFrustumMap") {
    grid.affine = false;
  } else {
    throw InputError(path, fmt::format("grid {}", shown(grid.name)), "a transform that OpenVDB has", shown(type));
  }
  bool finite = true;
  for (int axis = 0; axis < 3; ++axis)
    for (int k = 0; k < 3; ++k)
      finite = finite && std::isfinite(grid.linear[axis][k]) && std::isfinite(grid.translate[k]);
  if (!finite)
    throw InputError(path, fmt::format("grid {}", shown(grid.name)), "a transform of finite numbers", "others",
                     "the file is damaged");
}

/// From the list of grids to what stands in front of this one's tree.
void readGrid(const InputFile& file, VdbGrid& grid) {
  Section section(file, grid.begin, grid.end);
  grid.compression = section.number<std::uint32_t>("a grid's compression");
  if (grid.compression > (kVdbZip | kVdbActiveMask | kVdbBlosc))
    throw InputError(file.path(), fmt::format("grid {}: compression", shown(grid.name)), "zip, blosc or none",
                     fmt::format("{:#x}", grid.compression), "the file is damaged");
  readMetadata(file.path(), section, [&](std::string value) { grid.gridClass = std::move(value); });
  readTransform(file.path(), section, grid);
  grid.treeBegin = section.position();
}

std::string nameForPeople(const std::string& unique) {
  const std::size_t mark = unique.find(kSuffixMark);
  return mark == std::string::npos ? unique : fmt::format("{}[{}]", unique.substr(0, mark), unique.substr(mark + 1));
}

VdbGrid readDescriptor(const InputFile& file, Section& section) {
  VdbGrid grid;
  grid.unique = text(file.path(), section, "a grid's name");
  grid.name = nameForPeople(grid.unique);
  grid.type = text(file.path(), section, "a grid's type");
  if (grid.type.ends_with(kHalfSuffix)) {
    grid.half = true;
    grid.type.resize(grid.type.size() - kHalfSuffix.size());
  }
  grid.parent = text(file.path(), section, "the grid whose tree is shared");
  grid.begin = section.number<std::uint64_t>("a grid's place");
  section.number<std::uint64_t>("the place of a grid's blocks");
  grid.end = section.number<std::uint64_t>("a grid's end");
  if (grid.begin < section.position() || grid.begin > grid.end || grid.end > file.bytes())
    throw InputError(file.path(), fmt::format("grid {}", shown(grid.name)),
                     fmt::format("bytes between {} and the file's end at {}", section.position(), file.bytes()),
                     fmt::format("{} to {}", grid.begin, grid.end), "the file is cut off or damaged");
  return grid;
}

}  // namespace

bool beginsAsVdb(std::span<const std::byte> start) {
  return start.size() >= sizeof kMagic && std::memcmp(start.data(), kMagic, sizeof kMagic) == 0;
}

VdbLayout readVdbLayout(const InputFile& file) {
  const std::string& path = file.path();
  Section section(file, 0, file.bytes());
  if (std::memcmp(section.bytes(sizeof kMagic, "OpenVDB magic number").data(), kMagic, sizeof kMagic) != 0)
    throw InputError(path, "OpenVDB magic number", "20 42 44 56 00 00 00 00", "something else");
  VdbLayout layout;
  layout.fileVersion = section.number<std::uint32_t>("OpenVDB file version");
  if (layout.fileVersion < kLeastVersion || layout.fileVersion > kMostVersion)
    throw InputError(path, "OpenVDB file version",
                     fmt::format("{} to {} (OpenVDB 2.1 to 12)", kLeastVersion, kMostVersion),
                     fmt::format("{}", layout.fileVersion), "save it anew with the program that made it, or vdb_print");
  layout.libraryMajor = section.number<std::uint32_t>("OpenVDB library version");
  layout.libraryMinor = section.number<std::uint32_t>("OpenVDB library version");
  const auto hasPlaces = section.number<std::uint8_t>("OpenVDB header");
  section.bytes(kUuidBytes, "OpenVDB file's identity");
  readMetadata(path, section, [](std::string) {});
  if (hasPlaces == 0)
    throw InputError(path, "OpenVDB header", "the places of its grids", "a file that was written as a stream",
                     "openvdb::io::File, vdb.write and every program's export write them");
  const auto count = section.number<std::uint32_t>("number of grids");
  std::uint64_t at = section.position();
  for (std::uint32_t k = 0; k < count; ++k) {  // each takes 36 bytes at least, so a damaged count ends with the file
    Section descriptor(file, at, file.bytes());
    VdbGrid grid = readDescriptor(file, descriptor);
    readGrid(file, grid);
    at = grid.end;
    layout.grids.push_back(std::move(grid));
  }
  return layout;
}

}  // namespace mote
