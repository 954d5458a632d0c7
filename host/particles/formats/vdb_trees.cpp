#include "host/particles/formats/vdb_trees.h"

#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/tools/Interpolation.h>

#include <cstring>
#include <istream>
#include <mutex>
#include <new>
#include <numeric>
#include <optional>
#include <streambuf>

#include "host/core/error.h"
#include "host/particles/formats/section.h"

namespace mote {
namespace {

namespace points = openvdb::points;

/// OpenVDB's registry of types; once a process.
void initialize() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

/// Bytes in memory as a stream.
class MemoryBuffer : public std::streambuf {
 public:
  explicit MemoryBuffer(const std::vector<std::byte>& bytes) {
    char* begin = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));  // it is only read
    setg(begin, begin, begin + bytes.size());
  }
};

/// Runs `body` and says in our words what OpenVDB throws.
template <class Body>
auto guarded(const VdbTree& tree, const Body& body) {
  try {
    return body();
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for grid {}", tree.path, shown(tree.grid)));
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {  // openvdb::Exception, std::ios_base::failure
    throw InputError(tree.path, fmt::format("grid {}", shown(tree.grid)), "a tree that OpenVDB reads",
                     fmt::format("'{}'", error.what()), "the file is damaged");
  }
}

template <class Grid>
typename Grid::Ptr readTree(const VdbTree& tree) {
  initialize();
  MemoryBuffer buffer(tree.bytes);
  std::istream stream(&buffer);
  // checkVdbTree has seen the end; this is the second lock on that door.
  stream.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
  openvdb::io::StreamMetadata::Ptr metadata(new openvdb::io::StreamMetadata);
  metadata->setHalfFloat(tree.half);
  openvdb::io::setStreamMetadataPtr(stream, metadata, /*transfer=*/false);
  openvdb::io::setVersion(stream, openvdb::VersionId(tree.libraryMajor, tree.libraryMinor), tree.fileVersion);
  openvdb::io::setDataCompression(stream, tree.compression);
  const auto grid = Grid::create();
  grid->setSaveFloatAsHalf(tree.half);
  grid->readTopology(stream);
  grid->readBuffers(stream);
  return grid;
}

ivec3 coordinates(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

template <class Grid>
void fillVolume(const VdbTree& tree, Volume& volume) {
  const auto grid = readTree<Grid>(tree);
  const std::size_t leaves = grid->tree().leafCount();
  volume.leaves.reserve(leaves), volume.values.reserve(leaves * kVolumeLeafVoxels);
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    const auto* values = leaf->buffer().data();
    volume.addLeaf(
        coordinates(leaf->origin()), [&](std::size_t k) { return leaf->isValueOn(static_cast<openvdb::Index>(k)); },
        [&](std::size_t k) { return static_cast<double>(values[k]); });
  }
  auto tiles = grid->tree().cbeginValueOn();
  tiles.setMaxDepth(std::remove_reference_t<decltype(grid->tree())>::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tiles; ++tiles) {
    openvdb::CoordBBox box;
    tiles.getBoundingBox(box);
    volume.addTile(coordinates(box.min()), box.dim().x(), static_cast<double>(*tiles));
  }
}

template <class Sampler>
void sampleVelocities(const openvdb::Vec3SGrid& grid, const dmat3& toIndex, const dvec3& translate,
                      std::span<const VolumeSample> at, std::span<vec3> velocities) {
  auto accessor = grid.getConstAccessor();
  for (std::size_t i = 0; i < at.size(); ++i) {
    const dvec3 index = toIndex * (at[i].position - translate);
    // Beyond the coordinates that trees have nothing moves.
    const bool inside = glm::all(glm::lessThan(glm::abs(index), dvec3(1 << 30)));
    const openvdb::Vec3s v =
        inside ? Sampler::sample(accessor, openvdb::Vec3R(index.x, index.y, index.z)) : openvdb::Vec3s(0);
    velocities[i] = vec3(v.x(), v.y(), v.z());
  }
}

// ---- points ----

struct AttributeType {
  const char* name;
  NumberType type;
  std::uint32_t arity;
};
const std::string kPosition = "Position";
constexpr AttributeType kAttributeTypes[] = {
    {"float", NumberType::F32, 1}, {"double", NumberType::F64, 1}, {"int8", NumberType::I8, 1},
    {"int16", NumberType::I16, 1}, {"int32", NumberType::I32, 1},  {"int64", NumberType::I64, 1},
    {"vec3s", NumberType::F32, 3}, {"vec3d", NumberType::F64, 3},  {"vec3i", NumberType::I32, 3}};

const AttributeType* attributeType(const std::string& name) {
  for (const AttributeType& type : kAttributeTypes)
    if (name == type.name) return &type;
  return nullptr;
}

using PointLeaf = points::PointDataTree::LeafNodeType;

/// All of an attribute's values in a leaf, decoded.
template <class T>
void fillValues(const points::AttributeArray& array, std::size_t count, std::byte* to) {
  const points::AttributeHandle<T> handle(array);
  for (std::size_t i = 0; i < count; ++i) {
    const T value = handle.get(static_cast<openvdb::Index>(i));
    std::memcpy(to + i * sizeof(T), &value, sizeof(T));
  }
}

}  // namespace

void readVdbVolume(const VdbTree& tree, Volume& volume) {
  guarded(tree, [&] {
    if (tree.type == "Tree_double_5_4_3") {
      fillVolume<openvdb::DoubleGrid>(tree, volume);
    } else {
      fillVolume<openvdb::FloatGrid>(tree, volume);
    }
  });
}

VelocityField readVdbVelocity(const VdbTree& tree, const dmat3& linear, const dvec3& translate, bool staggered) {
  return guarded(tree, [&]() -> VelocityField {
    const openvdb::Vec3SGrid::Ptr grid = readTree<openvdb::Vec3SGrid>(tree);
    auto* const sample = staggered ? sampleVelocities<openvdb::tools::StaggeredBoxSampler>
                                   : sampleVelocities<openvdb::tools::BoxSampler>;
    return [grid, sample, toIndex = glm::inverse(linear), translate](std::span<const VolumeSample> at,
                                                                     std::span<vec3> velocities) {
      sample(*grid, toIndex, translate, at, velocities);
    };
  });
}

struct VdbPoints::Grid {
  dmat3 linear;
  dvec3 translate;
  points::PointDataGrid::Ptr grid;
  std::vector<const PointLeaf*> leaves;
  std::vector<Channel> channels;
  std::vector<std::size_t> attributes;  ///< by channel
  std::uint64_t count = 0;

  void addLeaf(const VdbTree& tree, const PointLeaf& leaf) {
    // Where each voxel's points end must ascend up to the number of all: what is counted from it is read from arrays.
    std::uint32_t before = 0;
    bool ascending = true;
    for (openvdb::Index k = 0; k < PointLeaf::SIZE; ++k) {
      const std::uint32_t end = leaf.getValue(k);
      ascending = ascending && end >= before;
      before = end;
    }
    const std::size_t size = leaf.attributeSet().size() > 0 ? leaf.attributeSet().getConst(0)->size() : 0;
    if (!ascending || before > size)
      throw InputError(tree.path,
                       fmt::format("grid {}: points of the leaf at {}, {}, {}", shown(tree.grid), leaf.origin().x(),
                                   leaf.origin().y(), leaf.origin().z()),
                       fmt::format("places up to {}", size), ascending ? fmt::format("{}", before) : "none that ascend",
                       "the file is damaged");
    leaves.push_back(&leaf);
    count += before;
  }

  void addChannels(const VdbTree& tree) {
    const auto& descriptor = leaves[0]->attributeSet().descriptor();
    const auto add = [&](const std::string& name, std::size_t at) {
      const AttributeType* type = attributeType(descriptor.valueType(at));
      if (!type || descriptor.type(at).second == "grp" || descriptor.type(at).second == "str") return;
      const bool place = name == "P";
      if (!place && name == kPosition) return;  // P's name here
      if (place && (type->arity != 3 || type->type == NumberType::I32))
        throw InputError(tree.path, "attribute 'P'", "vec3s or vec3d", fmt::format("'{}'", type->name));
      channels.push_back({place ? kPosition : name, place ? NumberType::F64 : type->type, type->arity});
      attributes.push_back(at);
    };
    if (const std::size_t at = descriptor.find("P"); at != points::AttributeSet::INVALID_POS) add("P", at);
    for (const auto& [name, at] : descriptor.map())
      if (name != "P") add(name, at);
  }

  template <class T>
  void fillPlaces(const points::AttributeArray& array, const PointLeaf& leaf, std::byte* to) const {
    const points::AttributeHandle<T> places(array);
    openvdb::Index point = 0;
    for (openvdb::Index k = 0; k < PointLeaf::SIZE; ++k)
      for (const openvdb::Index end = leaf.getValue(k); point < end; ++point, to += 3 * sizeof(double)) {
        const openvdb::Coord voxel = leaf.offsetToGlobalCoord(k);
        const T p = places.get(point);  // from the voxel's centre
        const dvec3 index = dvec3(voxel.x(), voxel.y(), voxel.z()) + dvec3(p.x(), p.y(), p.z());
        const dvec3 world = linear * index + translate;
        std::memcpy(to, &world.x, 3 * sizeof(double));
      }
  }
};

VdbPoints::VdbPoints(const VdbTree& tree, const dmat3& linear, const dvec3& translate) : grid_(new Grid) {
  grid_->linear = linear, grid_->translate = translate;
  guarded(tree, [&] {
    grid_->grid = readTree<points::PointDataGrid>(tree);
    for (auto leaf = grid_->grid->tree().cbeginLeaf(); leaf; ++leaf) grid_->addLeaf(tree, *leaf);
    if (!grid_->leaves.empty()) grid_->addChannels(tree);
  });
}
VdbPoints::~VdbPoints() = default;

std::uint64_t VdbPoints::count() const { return grid_->count; }
const std::vector<Channel>& VdbPoints::channels() const { return grid_->channels; }
std::size_t VdbPoints::leaves() const { return grid_->leaves.size(); }
std::size_t VdbPoints::pointsOf(std::size_t leaf) const { return grid_->leaves[leaf]->getValue(PointLeaf::SIZE - 1); }

void VdbPoints::fill(std::size_t channel, std::size_t leaf, std::byte* to) const {
  const PointLeaf& node = *grid_->leaves[leaf];
  const Channel& c = grid_->channels[channel];
  const std::size_t attribute = grid_->attributes[channel], count = pointsOf(leaf);
  const points::AttributeArray& array = *node.attributeSet().getConst(attribute);
  if (c.name == kPosition) {
    if (array.hasValueType<openvdb::Vec3f>()) return grid_->fillPlaces<openvdb::Vec3f>(array, node, to);
    return grid_->fillPlaces<openvdb::Vec3d>(array, node, to);
  }
  if (c.arity == 3) {
    if (c.type == NumberType::F32) return fillValues<openvdb::Vec3f>(array, count, to);
    if (c.type == NumberType::F64) return fillValues<openvdb::Vec3d>(array, count, to);
    return fillValues<openvdb::Vec3i>(array, count, to);
  }
  switch (c.type) {
    case NumberType::F32: return fillValues<float>(array, count, to);
    case NumberType::F64: return fillValues<double>(array, count, to);
    case NumberType::I8: return fillValues<std::int8_t>(array, count, to);
    case NumberType::I16: return fillValues<std::int16_t>(array, count, to);
    case NumberType::I32: return fillValues<std::int32_t>(array, count, to);
    default: return fillValues<std::int64_t>(array, count, to);
  }
}

}  // namespace mote
