#include "host/particles/formats/vdb_reader.h"

#include "host/core/error.h"
#include "host/particles/formats/vdb_layout.h"

#ifdef MOTE_HAS_OPENVDB

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <new>

#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/vdb_check.h"
#include "host/particles/formats/vdb_trees.h"
#include "host/particles/formats/volume_particles.h"

namespace mote {
namespace {

/// The grid's own tree, or that of the grid it shares it with.
const VdbGrid& treeOwner(const std::string& path, const VdbLayout& layout, const VdbGrid& grid) {
  if (grid.parent.empty()) return grid;
  for (const VdbGrid& other : layout.grids)
    if (other.unique == grid.parent && other.parent.empty() && other.type == grid.type) return other;
  throw InputError(path, fmt::format("grid '{}'", grid.name), "the grid whose tree it shares", "none of that name",
                   "the file is damaged");
}

VdbTree checkedTree(const InputFile& file, const VdbLayout& layout, const VdbGrid& grid) {
  const VdbGrid& owner = treeOwner(file.path(), layout, grid);
  VdbTree tree{.path = file.path(),
               .grid = grid.name,
               .type = owner.type,
               .half = owner.half,
               .compression = owner.compression,
               .fileVersion = layout.fileVersion,
               .libraryMajor = layout.libraryMajor,
               .libraryMinor = layout.libraryMinor,
               .begin = owner.treeBegin,
               .bytes = {}};
  tree.bytes.resize(static_cast<std::size_t>(owner.end - owner.treeBegin));
  file.seek(owner.treeBegin);
  if (file.read(tree.bytes.data(), tree.bytes.size()) != tree.bytes.size())
    throw InputError(file.path(), fmt::format("grid '{}'", grid.name), fmt::format("{} bytes", tree.bytes.size()),
                     "the file's end", "it became shorter while it was read");
  checkVdbTree(tree);
  return tree;
}

constexpr char kSurfaceHint[] = "a level set is a surface: vdb_tool or Houdini's Convert VDB make a fog volume of it";

std::string formatName(const VdbLayout& layout, const char* what) {
  return fmt::format("OpenVDB {}.{} ({})", layout.libraryMajor, layout.libraryMinor, what);
}

bool isLevelSet(const VdbGrid& grid) { return grid.gridClass == "level set"; }
bool isVolume(const VdbGrid& grid) { return isVdbScalarTree(grid.type) && !isLevelSet(grid) && grid.affine; }
bool isPoints(const VdbGrid& grid) { return isVdbPointTree(grid.type) && grid.affine; }

/// Why a grid cannot be made particles.
std::string described(const VdbGrid& grid) {
  return fmt::format("'{}' ({}{}{}{})", grid.name, isLevelSet(grid) ? "a level set, " : "", grid.type,
                     grid.half ? " in float16" : "", grid.affine ? "" : ", in a camera's frustum");
}
std::string described(std::span<const VdbGrid> grids) {
  std::string all;
  for (const VdbGrid& grid : grids) all += (all.empty() ? "" : ", ") + described(grid);
  return all.empty() ? "no grid" : all;
}

std::vector<Metadata> gridMetadata(const VdbLayout& layout) {
  std::vector<Metadata> list;
  for (std::size_t k = 0; k < layout.grids.size(); ++k) {
    const VdbGrid& grid = layout.grids[k];
    list.push_back(Metadata::text("", fmt::format("grid_{}", k),
                                  described(grid) + (grid.gridClass.empty() ? "" : ", class " + grid.gridClass)));
  }
  return list;
}

const VdbGrid* velocityGrid(const VdbLayout& layout) {
  for (const char* name : {"v", "vel", "velocity"})
    for (const VdbGrid& grid : layout.grids)
      if (grid.name == name && isVdbVectorTree(grid.type) && grid.affine) return &grid;
  return nullptr;
}

std::unique_ptr<ParticleFile> openVolume(const InputFile& file, const VdbLayout& layout, const VdbGrid& grid,
                                         const VolumeSampling& sampling) {
  Volume volume;
  volume.grid = grid.name;
  volume.linear = grid.linear, volume.translate = grid.translate;
  readVdbVolume(checkedTree(file, layout, grid), volume);
  VolumeExtras extras{formatName(layout, "fog volume"), {}, gridMetadata(layout)};
  if (const VdbGrid* velocity = velocityGrid(layout))
    extras.velocity = readVdbVelocity(checkedTree(file, layout, *velocity), velocity->linear, velocity->translate,
                                      velocity->gridClass == "staggered");
  return std::make_unique<VolumeParticles>(file.path(), std::move(volume), std::move(extras), sampling);
}

/// A point grid's points.
class VdbPointsFile : public ParticleFile {
 public:
  VdbPointsFile(const InputFile& file, const VdbLayout& layout, const VdbGrid& grid)
      : ParticleFile(file.path()), points_(checkedTree(file, layout, grid), grid.linear, grid.translate) {
    format_ = formatName(layout, "points");
    metadata_ = gridMetadata(layout);
    metadata_.push_back(Metadata::text("", "grid", grid.name));
    count_ = points_.count();
    channels_ = points_.channels();
    if (channels_.empty()) channels_.push_back({"Position", NumberType::F64, 3});  // of a grid without points
  }

  void read(std::span<const ChannelRequest> requests) const override {
    std::vector<ChannelSink> sinks;
    for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
    try {
      for (ChannelSink& sink : sinks) sink.reserve(count_);
      constexpr std::size_t kPointsAtOnce = 1 << 16;
      for (std::size_t leaf = 0; leaf < points_.leaves();) {
        std::vector<std::size_t> firsts;  // of each leaf's points in the block
        std::size_t count = 0;
        const std::size_t begin = leaf;
        for (; leaf < points_.leaves() && (leaf == begin || count < kPointsAtOnce); ++leaf)
          firsts.push_back(count), count += points_.pointsOf(leaf);
        readBlock(sinks, begin, firsts, count);
      }
    } catch (const std::bad_alloc&) {
      throw MachineError(fmt::format("{}: not enough memory for {} points", path_, count_));
    }
  }

 private:
  void readBlock(std::vector<ChannelSink>& sinks, std::size_t begin, const std::vector<std::size_t>& firsts,
                 std::size_t count) const {
    std::vector<std::byte> values;
    for (ChannelSink& sink : sinks) {
      const std::size_t bytes = channels_[sink.index()].bytes();
      values.resize(count * bytes);
      parallelBlocks(firsts.size(), 8, [&](std::size_t from, std::size_t to) {
        for (std::size_t k = from; k < to; ++k)
          points_.fill(sink.index(), begin + k, values.data() + firsts[k] * bytes);
      });
      sink.append(values.data(), bytes, count);
    }
  }

  VdbPoints points_;
};

}  // namespace

std::unique_ptr<ParticleFile> openVdb(const std::string& path, const VolumeSampling& sampling) {
  const InputFile file(path);
  const VdbLayout layout = readVdbLayout(file);
  std::vector<std::string> names;
  std::vector<const VdbGrid*> usable;
  // Points are particles already; a volume beside them is meant only where its name is said.
  for (const bool points : {true, false})
    for (const VdbGrid& grid : layout.grids)
      if (points ? isPoints(grid) : isVolume(grid))
        if (points || !sampling.grid.empty() || usable.empty() || !isPoints(*usable[0]))
          usable.push_back(&grid), names.push_back(grid.name);
  if (!sampling.grid.empty())
    for (const VdbGrid& grid : layout.grids)
      if (grid.name == sampling.grid && !isPoints(grid) && !isVolume(grid))
        throw InputError(path, "grid", "points, or a fog volume of float or double", described(grid), kSurfaceHint);
  if (usable.empty())
    throw InputError(path, "", "a grid of points, or a fog volume of float or double", described(layout.grids),
                     kSurfaceHint);
  const VdbGrid& grid = *usable[chosenGrid(path, names, sampling.grid)];
  if (isVolume(grid)) return openVolume(file, layout, grid, sampling);
  constexpr std::uint32_t kPointsVersion = 224;  // before it they were stored otherwise
  if (layout.fileVersion < kPointsVersion)
    throw InputError(path, "OpenVDB file version", fmt::format("{} for points", kPointsVersion),
                     fmt::format("{}", layout.fileVersion), "save it anew with OpenVDB 5 or later");
  return std::make_unique<VdbPointsFile>(file, layout, grid);
}

}  // namespace mote

#else

namespace mote {

std::unique_ptr<ParticleFile> openVdb(const std::string& path, const VolumeSampling&) {
  throw InputError(path, "", "a format that this build of Mote reads",
                   "OpenVDB, which it was built without (CMake: -DMOTE_OPENVDB=OFF)",
                   "use a build with it, or save a NanoVDB file: nanovdb_convert smoke.vdb smoke.nvdb");
}

}  // namespace mote

#endif
