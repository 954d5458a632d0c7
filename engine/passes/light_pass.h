// Exact lighting in compute shaders: the columns and beams of host/lighting (beams.h, column.h, beam.h), on the device.
//
// The host plans them and places the rays, in double. Then one subgroup a column walks the tree and lists what lies in
// the column's way (light_gather.comp), and one subgroup a beam chooses from that and adds up (light_sum.comp). Lists
// are of fixed length: where one is full, it is added up, and the walk goes on from there in the next dispatch.
//
// This suits hardware: nearly all loads are the same for a subgroup or side by side; branches are the subgroup's, none
// a lane's; the inner loop works on registers alone; subgroups are independent, without shared memory, atomics or
// barriers of a workgroup, and hundreds of columns and beams are under way at once: 95 M rays/s on an H100.
// (light_sum.comp says why it is as it is for lavapipe.)
//
// Every array is addressed by device address, so none is bound by maxStorageBufferRange.
#pragma once
#include <map>
#include <vector>

#include "engine/vulkan/device.h"
#include "host/lighting/exact/beams.h"
#include "host/lighting/lighting.h"
#include "host/octree/octree.h"

namespace mote {

class LightPass {
 public:
  /// `device` must outlive the pass.
  LightPass(const Device& device, layout::uint falloff, layout::uint endpoint);

  /// Takes the tree, which must stay alive: 20 bytes a particle on the device (28 with three channels), 32 bytes a
  /// node. Where the device's budget has no room for that beside what opticalDepths needs, the tree is cut into parts
  /// that are there one at a time. Throws MachineError where not even a leaf fits.
  void setTree(const Octree& tree);
  /// How many parts the tree has.
  std::size_t parts() const { return parts_.size(); }

  /// As mote::opticalDepths for the tree that was set, with the rules of the constructor; T within 2e-5 of it for
  /// cutoff 0. Needs on the device, beside the tree and however many receivers there are, about 65 MiB on CPU devices
  /// and 500 MiB on others, or what the budget leaves of it, 3 MiB at least; on the host 16 bytes a receiver.
  /// A tree in parts is passed once a part, which copies it to the device once a light; sums are then in another order,
  /// so T differs from that of the whole tree by rounding and, as ever, by at most the cutoff: a ray that one part has
  /// made dark meets no later one.
  std::vector<float> opticalDepths(const Receivers& receivers, const layout::Light& light,
                                   const LightingOptions& options, std::span<const std::uint8_t> reached = {},
                                   const RaysDone& done = {});
  /// … from every slot of the tree.
  std::vector<float> opticalDepths(const layout::Light& light, const LightingOptions& options,
                                   const RaysDone& done = {});

  /// Device seconds of all opticalDepths calls so far, from timestamps.
  double deviceSeconds() const { return deviceSeconds_; }
  /// Gives back to the device's budget what the last opticalDepths needed beside the tree; the next takes it again.
  void release() { buffers_ = {}; }

 private:
  /// What shaders are compiled for, beside the pass and the tree. `careful`: of any beam (gather), of the beam (sum).
  struct GatherVariant {
    bool perspective, careful, exact;
    auto operator<=>(const GatherVariant&) const = default;
  };
  struct SumVariant {
    bool perspective, careful, nearLight;
    auto operator<=>(const SumVariant&) const = default;
  };
  /// Columns that are computed together: what the host has set up, and where it is on the device.
  struct Piece {
    std::vector<layout::LightColumn> columns;
    std::vector<layout::vec4> planes;
    std::vector<layout::LightBeam> plain, careful;
    std::vector<layout::LightRay> rays;
    std::vector<std::uint32_t> receivers;  ///< of the rays
    bool perspective, exact, nearLight;
  };
  /// How much of each there is in a piece, or room for.
  struct Extent {
    std::size_t columns = 0, beams = 0, rays = 0;
    bool within(const Extent& e) const { return columns <= e.columns && beams <= e.beams && rays <= e.rays; }
  };
  struct Buffers {
    Buffer columns, planes, walks, beams, rays, depths, found, order, chosen, chosenIndex;
    Extent room;
  };
  /// Nodes [firstNode, endNode) in the order of the walk, which needs no more than that, and their particles.
  struct Part {
    std::uint32_t firstNode, endNode, firstSlot, endSlot;
  };
  struct Tuning;
  static Tuning tuning(const Device& device);

  std::vector<SpecializationConstant> constants(bool perspective, bool careful) const;
  const ComputePipeline& gather(const GatherVariant& variant);
  const ComputePipeline& sum(const SumVariant& variant);
  std::vector<std::uint64_t> partSizes(const Part& part) const;
  std::vector<std::uint64_t> bufferSizes(const Extent& extent) const;  // in the order of Buffers
  void load(std::size_t part);
  bool hasRoom(const Extent& extent) const;
  void makeRoom(const Extent& extent);
  std::vector<std::uint8_t> stillBright(std::span<const float> depths, std::size_t count,
                                        std::span<const std::uint8_t> reached, float limit) const;
  Piece setUp(const Receivers& receivers, const layout::Light& light, const Beams& beams, std::size_t first,
              std::size_t last) const;
  std::vector<float> run(const Piece& piece, float limit);

  const Device& device_;
  TimestampQueries queries_;
  layout::uint falloff_, endpoint_;
  const Octree* tree_ = nullptr;
  float greatestRadius_ = 0;
  std::map<GatherVariant, ComputePipeline> gathers_;
  std::map<SumVariant, ComputePipeline> sums_;
  std::vector<Part> parts_;  // of the tree; none for no particles
  std::size_t loaded_ = 0;   // the one on the device; parts_.size(): none
  Buffer nodes_, particles_, peaks_;
  Buffers buffers_;
  double deviceSeconds_ = 0;
};

}  // namespace mote
