#include "host/particles/formats/nanovdb_reader.h"

#include <blosc.h>
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

#include "host/core/error.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/section.h"
#include "host/particles/formats/volume_particles.h"

namespace mote {
namespace {

constexpr std::string_view kMagic = "NanoVDB";  // and a digit: 0 up to 32.5, 2 later; 1 is a grid without a file's head
enum : std::uint16_t { kPlain = 0, kZip = 1, kBlosc = 2 };
constexpr std::uint32_t kFloat = 1, kLevelSet = 1;  // of GridType, GridClass
constexpr const char* kTypes[] = {"?",     "float", "double", "int16",  "int32", "int64", "Vec3f",
                                  "Vec3d", "Mask",  "Half",   "uint32", "bool",  "RGBA8", "Fp4",
                                  "Fp8",   "Fp16",  "FpN",    "Vec4f",  "Vec4d", "Index"};

// Of a grid in memory [bytes].
constexpr std::size_t kTreeAt = 672, kMatrixAt = 384, kTranslateAt = 528;  // the map's numbers in double
constexpr std::size_t kTreeBytes = 64, kRootBytes = 64, kRootTileBytes = 32;
constexpr std::size_t kNodeMaskAt = 32;  // behind a node's box and flags
/// Inner nodes: value mask, child mask, statistics, values of 8 bytes.
struct NodeKind {
  const char* name;
  std::int32_t childEdge;
  int log2;  ///< children along an edge
  std::size_t values() const { return std::size_t{1} << (3 * log2); }
  std::size_t maskBytes() const { return values() / 8; }
  std::size_t valuesAt() const { return (kNodeMaskAt + 2 * maskBytes() + 16 + 31) / 32 * 32; }
  std::size_t bytes() const { return valuesAt() + 8 * values(); }
  std::int32_t edge() const { return childEdge << log2; }
};
constexpr NodeKind kLower{"lower nodes", 8, 4}, kUpper{"upper nodes", 128, 5};
constexpr std::size_t kLeafMaskAt = 16, kLeafValuesAt = 96, kLeafBytes = 2144;
constexpr std::int32_t kMostCoordinate = 1 << 30;

/// What the file says of one grid.
struct Entry {
  std::string name;
  std::uint64_t begin = 0, fileBytes = 0, bytes = 0;  ///< where it stands, packed, and unpacked
  std::uint64_t voxels = 0;
  std::uint32_t type = 0, gridClass = 0;
  std::uint16_t codec = 0;

  bool usable() const { return type == kFloat && gridClass != kLevelSet; }
  std::string described() const {
    return fmt::format("{} ({}{})", shown(name), gridClass == kLevelSet ? "a level set of " : "",
                       type < std::size(kTypes) ? kTypes[type] : "an unknown type");
  }
};

struct Head {
  std::uint32_t major = 0, minor = 0, patch = 0;
  std::vector<Entry> entries;
};

/// The heads of all of a file's segments.
Head readHead(const InputFile& file) {
  const std::string& path = file.path();
  Head head;
  for (std::uint64_t at = 0; at < file.bytes();) {
    Section section(file, at, file.bytes());
    const std::string magic = section.bytes(8, "NanoVDB magic number");
    if (!magic.starts_with(kMagic) || (magic[7] != '0' && magic[7] != '2'))
      throw InputError(path, fmt::format("NanoVDB magic number at byte {}", at), "NanoVDB0 or NanoVDB2", shown(magic),
                       magic.starts_with(kMagic) ? "a grid as it stands in memory: write it with nanovdb::io::writeGrid"
                                                 : "the file is damaged");
    const auto version = section.number<std::uint32_t>("NanoVDB version");
    head.major = version >> 21, head.minor = version >> 10 & 0x7ff, head.patch = version & 0x3ff;
    if (head.major != 32 || head.minor < 3)
      throw InputError(path, "NanoVDB version", "32.3 or later",
                       fmt::format("{}.{}.{}", head.major, head.minor, head.patch),
                       "make it anew with nanovdb_convert");
    const auto grids = section.number<std::uint16_t>("number of grids");
    const auto codec = section.number<std::uint16_t>("NanoVDB codec");
    if (codec > kBlosc) throw InputError(path, "NanoVDB codec", "0 to 2 (none, zip, blosc)", fmt::format("{}", codec));
    const std::size_t first = head.entries.size();
    for (std::uint16_t g = 0; g < grids; ++g) {
      Entry entry;
      entry.codec = codec;
      entry.bytes = section.number<std::uint64_t>("a grid's size");
      entry.fileBytes = section.number<std::uint64_t>("a grid's size in the file");
      section.number<std::uint64_t>("hash of a grid's name");
      entry.voxels = section.number<std::uint64_t>("a grid's voxels");
      entry.type = section.number<std::uint32_t>("a grid's type");
      entry.gridClass = section.number<std::uint32_t>("a grid's class");
      section.bytes(48 + 24 + 24, "a grid's bounds");
      const auto nameBytes = section.number<std::uint32_t>("size of a grid's name");
      section.bytes(4 * 4 + 3 * 4 + 2 + 2 + 4, "a grid's nodes");
      entry.name = section.bytes(nameBytes, "a grid's name").c_str();  // with its NUL
      head.entries.push_back(std::move(entry));
    }
    at = section.position();
    for (std::size_t k = first; k < head.entries.size(); ++k) {
      Entry& entry = head.entries[k];
      if (entry.fileBytes > file.bytes() - at)
        throw InputError(path, fmt::format("grid {}", shown(entry.name)),
                         fmt::format("{} bytes at byte {}", entry.fileBytes, at),
                         fmt::format("only {}", file.bytes() - at), "the file is cut off or damaged");
      entry.begin = at, at += entry.fileBytes;
    }
  }
  return head;
}

// ---- unpacking ----

[[noreturn]] void throwDamaged(const InputFile& file, const Entry& entry, const std::string& expected,
                               const std::string& got) {
  throw InputError(file.path(), fmt::format("grid {}", shown(entry.name)), expected, got, "the file is damaged");
}

void unzip(const InputFile& file, const Entry& entry, std::span<const std::byte> packed, std::vector<std::byte>& grid) {
  constexpr std::size_t kSize = 8;  // the stream's length, which the entry says as well
  if (packed.size() < kSize) throwDamaged(file, entry, "a zlib stream", fmt::format("{} bytes", packed.size()));
  auto bytes = static_cast<uLongf>(grid.size());
  const int status = uncompress(reinterpret_cast<Bytef*>(grid.data()), &bytes,
                                reinterpret_cast<const Bytef*>(packed.data() + kSize), packed.size() - kSize);
  if (status == Z_MEM_ERROR) throw std::bad_alloc();
  if (status != Z_OK || bytes != grid.size())
    throwDamaged(file, entry, fmt::format("a zlib stream of {} bytes", grid.size()),
                 status == Z_OK ? fmt::format("{}", bytes) : "another");
}

void unpackBlosc(const InputFile& file, const Entry& entry, std::span<const std::byte> packed,
                 std::vector<std::byte>& grid) {
  std::size_t done = 0;
  while (done < grid.size()) {
    std::uint64_t size = 0;
    std::size_t bytes = 0;
    if (packed.size() >= sizeof size) std::memcpy(&size, packed.data(), sizeof size);
    if (size < BLOSC_MIN_HEADER_LENGTH || size > packed.size() - sizeof size ||
        blosc_cbuffer_validate(packed.data() + sizeof size, size, &bytes) != 0 || bytes == 0 ||
        bytes > grid.size() - done ||
        blosc_decompress_ctx(packed.data() + sizeof size, grid.data() + done, bytes, 1) != static_cast<int>(bytes))
      throwDamaged(file, entry, fmt::format("blosc buffers of {} bytes", grid.size()),
                   fmt::format("something else behind {}", done));
    done += bytes, packed = packed.subspan(sizeof size + size);
  }
}

/// The grid as it stands in memory.
std::vector<std::byte> unpacked(const InputFile& file, const Entry& entry) {
  const std::uint64_t most = entry.codec == kPlain ? entry.fileBytes : entry.fileBytes * kDeflateExpansion;
  if (entry.bytes < kTreeAt + kTreeBytes || entry.bytes > most)
    throwDamaged(file, entry, fmt::format("{} bytes to what {} can hold", kTreeAt + kTreeBytes, entry.fileBytes),
                 fmt::format("{}", entry.bytes));
  std::vector<std::byte> packed(static_cast<std::size_t>(entry.fileBytes));
  file.seek(entry.begin);
  if (file.read(packed.data(), packed.size()) != packed.size())
    throwDamaged(file, entry, fmt::format("{} bytes", packed.size()), "the file's end");
  if (entry.codec == kPlain) return packed;
  std::vector<std::byte> grid(static_cast<std::size_t>(entry.bytes));
  (entry.codec == kZip ? unzip : unpackBlosc)(file, entry, packed, grid);
  return grid;
}

// ---- nodes ----

class GridReader {
 public:
  GridReader(const InputFile& file, const Entry& entry) : file_(file), entry_(entry), grid_(unpacked(file, entry)) {}

  Volume read() {
    Volume volume;
    volume.grid = entry_.name;
    readMap(volume);
    const std::size_t tree = kTreeAt;
    std::uint64_t offset[4];  // of leaves, lower, upper nodes, the root; from the tree's head
    std::uint32_t count[3];
    std::memcpy(offset, &grid_[tree], sizeof offset);
    std::memcpy(count, &grid_[tree + sizeof offset], sizeof count);
    const std::byte* leaves = array("leaves", offset[0], count[0], kLeafBytes);
    const std::byte* lower = array(kLower.name, offset[1], count[1], kLower.bytes());
    const std::byte* upper = array(kUpper.name, offset[2], count[2], kUpper.bytes());
    volume.leaves.reserve(count[0]), volume.values.reserve(count[0] * kVolumeLeafVoxels);
    for (std::uint32_t k = 0; k < count[0]; ++k) addLeaf(volume, leaves + k * kLeafBytes);
    for (std::uint32_t k = 0; k < count[1]; ++k) addTiles(volume, kLower, lower + k * kLower.bytes());
    for (std::uint32_t k = 0; k < count[2]; ++k) addTiles(volume, kUpper, upper + k * kUpper.bytes());
    addRootTiles(volume, offset[3]);
    // Every active voxel is accounted for: what other versions of the layout would not be.
    if (volume.voxels != entry_.voxels)
      throwDamaged(file_, entry_, fmt::format("{} active voxels, as its head says", entry_.voxels),
                   fmt::format("{}", volume.voxels));
    return volume;
  }

 private:
  template <class T>
  static T at(const std::byte* from, std::size_t offset) {
    T value;
    std::memcpy(&value, from + offset, sizeof value);
    return value;
  }
  static bool bit(const std::byte* mask, std::size_t k) {
    return (std::to_integer<unsigned>(mask[k / 8]) >> (k % 8) & 1u) != 0;
  }

  void readMap(Volume& volume) const {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        volume.linear[column][row] =
            at<double>(grid_.data(), kMatrixAt + sizeof(double) * static_cast<std::size_t>(3 * row + column));
      volume.translate[row] = at<double>(grid_.data(), kTranslateAt + sizeof(double) * static_cast<std::size_t>(row));
    }
    bool finite = true;
    for (int k = 0; k < 3; ++k)
      for (int row = 0; row < 3; ++row)
        finite = finite && std::isfinite(volume.linear[k][row]) && std::isfinite(volume.translate[row]);
    if (!finite) throwDamaged(file_, entry_, "a map of finite numbers", "others");
  }
  const std::byte* array(const char* what, std::uint64_t offset, std::uint64_t count, std::size_t bytes) const {
    const std::uint64_t space = grid_.size() - kTreeAt;
    if (count > 0 && (offset > space || count > (space - offset) / bytes))
      throwDamaged(file_, entry_, fmt::format("its {} within {} bytes", what, space),
                   fmt::format("{} of {} bytes at {}", count, bytes, offset));
    return grid_.data() + kTreeAt + (count > 0 ? offset : 0);
  }
  /// A node's least coordinates, from the box of what is active in it.
  ivec3 origin(const std::byte* node, std::int32_t edge) const {
    ivec3 place(0);
    for (int axis = 0; axis < 3; ++axis) {
      const auto least = at<std::int32_t>(node, 4 * static_cast<std::size_t>(axis));
      if (least < -kMostCoordinate || least >= kMostCoordinate)
        throwDamaged(file_, entry_, "coordinates between ∓2³⁰", fmt::format("{}", least));
      place[axis] = least & ~(edge - 1);
    }
    return place;
  }
  void addLeaf(Volume& volume, const std::byte* leaf) const {
    const std::byte* mask = leaf + kLeafMaskAt;
    if (std::all_of(mask, mask + kVolumeLeafVoxels / 8, [](std::byte b) { return b == std::byte{0}; })) return;
    volume.addLeaf(
        origin(leaf, kVolumeLeafEdge), [&](std::size_t k) { return bit(mask, k); },
        [&](std::size_t k) { return static_cast<double>(at<float>(leaf, kLeafValuesAt + 4 * k)); });
  }
  void addTiles(Volume& volume, const NodeKind& kind, const std::byte* node) const {
    const std::byte *active = node + kNodeMaskAt, *children = active + kind.maskBytes();
    for (std::size_t k = 0; k < kind.values(); ++k) {
      if (!bit(active, k) || bit(children, k)) continue;
      const int last = (1 << kind.log2) - 1, index = static_cast<int>(k);
      const ivec3 place(index >> (2 * kind.log2), index >> kind.log2 & last, index & last);
      volume.addTile(origin(node, kind.edge()) + place * kind.childEdge, kind.childEdge,
                     static_cast<double>(at<float>(node, kind.valuesAt() + 8 * k)));
    }
  }
  void addRootTiles(Volume& volume, std::uint64_t offset) const {
    const std::byte* root = array("root", offset, 1, kRootBytes);
    const auto tiles = at<std::uint32_t>(root, 24);
    const std::byte* tile = array("root's tiles", offset + kRootBytes, tiles, kRootTileBytes);
    for (std::uint32_t k = 0; k < tiles; ++k, tile += kRootTileBytes) {
      const auto key = at<std::uint64_t>(tile, 0);
      const bool child = at<std::int64_t>(tile, 8) != 0;
      if (child || at<std::uint32_t>(tile, 16) == 0) continue;
      const auto coordinate = [&](int shift) {  // 20 of its 21 bits count
        return static_cast<std::int32_t>(static_cast<std::uint32_t>(key >> shift) << 12);
      };
      const ivec3 place(coordinate(42), coordinate(21), coordinate(0));
      if (glm::any(glm::lessThan(place, ivec3(-kMostCoordinate))) ||
          glm::any(glm::greaterThanEqual(place, ivec3(kMostCoordinate))))
        throwDamaged(file_, entry_, "coordinates between ∓2³⁰", fmt::format("{}, {}, {}", place.x, place.y, place.z));
      volume.addTile(place, kUpper.edge(), static_cast<double>(at<float>(tile, 20)));
    }
  }

  const InputFile& file_;
  const Entry& entry_;
  std::vector<std::byte> grid_;
};

}  // namespace

bool beginsAsNanoVdb(std::span<const std::byte> start) {
  return start.size() >= kMagic.size() && std::memcmp(start.data(), kMagic.data(), kMagic.size()) == 0;
}

std::unique_ptr<ParticleFile> openNanoVdb(const std::string& path, const VolumeSampling& sampling) {
  const InputFile file(path);
  const Head head = readHead(file);
  std::vector<std::string> names;
  std::vector<const Entry*> usable;
  std::string all;
  VolumeExtras extras{fmt::format("NanoVDB {}.{}.{} (fog volume)", head.major, head.minor, head.patch), {}, {}};
  for (const Entry& entry : head.entries) {
    if (entry.usable()) usable.push_back(&entry), names.push_back(entry.name);
    all += (all.empty() ? "" : ", ") + entry.described();
    extras.metadata.push_back(Metadata::text("", fmt::format("grid_{}", extras.metadata.size()), entry.described()));
  }
  constexpr const char* kHint = "nanovdb_convert makes float grids; a level set is a surface, not a density";
  for (const Entry& entry : head.entries)
    if (!sampling.grid.empty() && entry.name == sampling.grid && !entry.usable())
      throw InputError(path, "grid", "a fog volume of float", entry.described(), kHint);
  if (usable.empty()) throw InputError(path, "", "a fog volume of float", all.empty() ? "no grid" : all, kHint);
  const Entry& entry = *usable[chosenGrid(path, names, sampling.grid)];
  try {
    return std::make_unique<VolumeParticles>(path, GridReader(file, entry).read(), std::move(extras), sampling);
  } catch (const std::bad_alloc&) {
    throw MachineError(
        fmt::format("{}: not enough memory for grid {} of {} bytes", path, shown(entry.name), entry.bytes));
  }
}

}  // namespace mote
