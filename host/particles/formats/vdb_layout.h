// Where things stand in an OpenVDB file, up to each grid's tree. Source: OpenVDB 10's io/Archive.cc,
// io/GridDescriptor.cc, MetaMap.cc and math/Maps.h.
//
// OpenVDB itself trusts every length in a file: damaged ones make it allocate or write without limit. So nothing of it
// is called before this, and vdb_check.h for the tree, have found every length within the file.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/core/vec.h"
#include "host/particles/formats/input_file.h"

namespace mote {

bool beginsAsVdb(std::span<const std::byte> start);

/// Bits of VdbGrid::compression.
enum : std::uint32_t { kVdbZip = 1, kVdbActiveMask = 2, kVdbBlosc = 4 };

struct VdbGrid {
  std::string unique;  ///< name as stored, unique in the file
  std::string name;    ///< for people: "density", "density[1]" where there are two
  std::string type;    ///< "Tree_float_5_4_3"
  bool half = false;   ///< numbers are stored as float16
  std::string parent;  ///< unique name of the grid whose tree it shares; empty: its own
  std::uint64_t begin = 0, end = 0;

  // What stands in front of the tree.
  std::uint32_t compression = 0;
  std::string gridClass;        ///< "fog volume", "level set", "staggered", "unknown" …
  bool affine = false;          ///< else its transform is not: a frustum
  glm::dmat3 linear{1};         ///< world = linear · index + translate
  dvec3 translate{0};           ///< …
  std::uint64_t treeBegin = 0;  ///< of its own tree
};

struct VdbLayout {
  std::uint32_t fileVersion = 0, libraryMajor = 0, libraryMinor = 0;
  std::vector<VdbGrid> grids;
};

/// Throws InputError: a file that is cut off or damaged in front of a tree, of a version other than 222 to 224 (OpenVDB
/// 2.1 and later), or written as a stream, without places of grids. Cost: a few reads a grid.
VdbLayout readVdbLayout(const InputFile& file);

}  // namespace mote
