// Whether an OpenVDB tree can be read: every length in it held against the bytes that are there.
//
// OpenVDB 10 reads what lengths say into buffers of the size it expects, and checks afterwards. So the whole of a tree
// is gone through before OpenVDB sees it: masks, values, compressed parts, and for points the arrays' descriptor, sizes
// and pages. What is let through, OpenVDB reads within its buffers, with memory in proportion to the file.
// Source: OpenVDB 10's tree/*.h, io/Compression.*, points/PointDataGrid.h, AttributeArray.h, AttributeSet.cc and
// StreamCompression.cc.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace mote {

/// A grid's tree as it stands in the file.
struct VdbTree {
  std::string path, grid;  ///< for messages
  std::string type;        ///< "Tree_float_5_4_3"
  bool half = false;
  std::uint32_t compression = 0;
  std::uint32_t fileVersion = 0, libraryMajor = 0, libraryMinor = 0;
  std::uint64_t begin = 0;       ///< where it stands in the file
  std::vector<std::byte> bytes;  ///< from there to the grid's end
};

/// "Tree_float_5_4_3" and the like: trees of one number or vector a voxel that are read.
bool isVdbScalarTree(const std::string& type);
bool isVdbVectorTree(const std::string& type);
bool isVdbPointTree(const std::string& type);

/// Throws InputError, which names the byte, on any breach. `type` must be one of those above. Cost: little beside that of reading the tree.
void checkVdbTree(const VdbTree& tree);

}  // namespace mote
