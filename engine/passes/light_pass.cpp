#include "engine/passes/light_pass.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

#include "engine/passes/part_size.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/lighting/exact/beam.h"
#include "spirv.h"

namespace mote {

/// Everything that depends on the kind of device.
struct LightPass::Tuning {
  BeamLimits beams;
  std::uint32_t groupSize;          ///< a multiple of every subgroup size
  std::uint32_t groupRays, groups;  ///< rays of a group, groups of a set: at most the least subgroup size
  std::uint32_t foundCapacity, chosenCapacity;
  std::uint32_t pieceColumns, pieceBeams, pieceRays;  ///< at most; beams and rays may be passed by one column's
};

namespace {

/// From a point of a column's frame, particles farther than this many least radii are placed in double.
constexpr double kExactRadii = 128;

/// On lavapipe a column's list has this many particles times the square of the subgroup's width. It ends a shader's
/// loops after 65535 steps altogether. Where every particle straddles every start, a beam of 320 rays takes a step for
/// each group of as many rays as a subgroup has lanes, and for each block of as many particles: with subgroups of 4 or
/// 8, 40960, which leaves enough for the rest; with wider ones less, as a list is no longer then and a group no larger.
constexpr std::uint32_t kFoundPerLanes = 128;

/// A buffer of at(0) … at(count − 1), made in pieces: no second copy of all on the host.
template <class T, class At>
Buffer uploadEach(const Device& device, std::size_t count, const At& at) {
  constexpr std::size_t kPiece = 1 << 20;
  Buffer buffer = device.createBuffer(count * sizeof(T));
  std::vector<T> piece;
  for (std::size_t begin = 0; begin < count; begin += kPiece) {
    piece.resize(std::min(kPiece, count - begin));
    parallelBlocks(piece.size(), 1 << 14, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) piece[i] = at(begin + i);
    });
    device.upload<T>(buffer, piece, begin);
  }
  return buffer;
}

vec3 lowPart(const dvec3& value) { return vec3(value - dvec3(vec3(value))); }
float lowPart(double value) { return static_cast<float>(value - static_cast<double>(static_cast<float>(value))); }

/// `amid`: the middle of the tree.
layout::LightColumn headerOf(const Column& column, const dvec3& amid) {
  const LightFrame& frame = column.frame;
  layout::LightColumn header{};
  header.planeOrigin = column.planes.origin;
  header.depthBase = static_cast<float>(column.depthBase), header.depthBaseLow = lowPart(column.depthBase);
  header.middle = vec3(frame.origin + glm::dot(amid - frame.origin, frame.axis) * frame.axis);
  const dvec3 offset = dvec3(header.middle) - frame.origin;
  header.u = vec3(frame.u), header.uLow = lowPart(frame.u);
  header.v = vec3(frame.v), header.vLow = lowPart(frame.v);
  header.axis = vec3(frame.axis), header.axisLow = lowPart(frame.axis);
  const dvec3 place(glm::dot(offset, frame.u), glm::dot(offset, frame.v), glm::dot(offset, frame.axis));
  header.middleU = static_cast<float>(place.x), header.middleULow = lowPart(place.x);
  header.middleV = static_cast<float>(place.y), header.middleVLow = lowPart(place.y);
  header.middleZ = static_cast<float>(place.z), header.middleZLow = lowPart(place.z);
  return header;
}

layout::LightBeam headerOf(const Beam& beam, const Column& column) {
  layout::LightBeam header{};
  header.turnU = vec3(beam.turn[0][0], beam.turn[0][1], beam.turn[0][2]);
  header.turnV = vec3(beam.turn[1][0], beam.turn[1][1], beam.turn[1][2]);
  header.turnW = vec3(beam.turn[2][0], beam.turn[2][1], beam.turn[2][2]);
  header.margin = column.margin;
  header.depthBase = static_cast<float>(column.depthBase);
  return header;
}

/// Rectangles of a column's beams, from which the device tells what may touch one.
struct BeamBoxes {
  struct Box {
    vec2 lo, hi;
  };
  std::vector<Box> boxes;
  float extentScale = 1;

  void add(const Beam& beam) {
    boxes.push_back({{beam.lowU, beam.lowV}, {beam.highU, beam.highV}});
    extentScale = std::max(extentScale, beam.extentScale);
  }
  /// Into the headers of the column and of its beams.
  void store(layout::LightColumn& column, std::span<layout::LightBeam> beams) const {
    constexpr float kSteps = 255;
    vec2 lo = boxes.front().lo, hi = boxes.front().hi;
    for (const Box& box : boxes) lo = glm::min(lo, box.lo), hi = glm::max(hi, box.hi);
    const vec2 scale = kSteps / glm::max(hi - lo, vec2(1e-30f));
    column.boxU = lo.x, column.boxV = lo.y, column.boxScaleU = scale.x, column.boxScaleV = scale.y;
    column.boxExtent = extentScale;
    // A step more on each side: the device may round in another way.
    const auto step = [&](float x, float slack) {
      return static_cast<layout::uint>(std::clamp(x + slack, 0.0f, kSteps));
    };
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      const vec2 low = (boxes[b].lo - lo) * scale, high = (boxes[b].hi - lo) * scale;
      beams[b].box = step(low.x, -1) | step(low.y, -1) << 8 | step(high.x, 1) << 16 | step(high.y, 1) << 24;
    }
  }
};

/// For a tree that has the slots [firstSlot, endSlot) alone.
layout::LightRay rayOf(const BeamRays& rays, std::size_t k, std::uint32_t firstSlot, std::uint32_t endSlot) {
  const std::uint32_t slot = rays.self[k];
  const std::uint32_t self = slot >= firstSlot && slot < endSlot ? slot - firstSlot : kNoSlot;
  return {rays.u[k], rays.v[k], rays.depth[k], self, rays.uLow[k], rays.vLow[k], rays.depthLow[k]};
}

}  // namespace

LightPass::Tuning LightPass::tuning(const Device& device) {
  Tuning t{};
  const std::uint32_t width = device.leastSubgroupSize();
  if (device.isCpu()) {
    // Measured on lavapipe (1 M rays of bench lighting, 256 bits), times relative to these: sets of 16 rays 1.07, of 24
    // 1.02, of 64 1.05 and twice as long to compile; columns of 2048 rays 1.1; beams of 192 rays 1.1, of 320 the same.
    t.beams = {4096, 256};
    t.groupSize = device.subgroupSize();
    t.groupRays = std::min(8u, width), t.groups = std::min(4u, width);
    t.foundCapacity = std::min(8192u, kFoundPerLanes * width * width);
    t.chosenCapacity = std::min(2048u, t.foundCapacity);
    t.pieceColumns = 32, t.pieceBeams = 448, t.pieceRays = 1 << 17;
  } else {
    // Not measured: few rays a set spare registers, many columns keep all of a device busy.
    t.beams = {1024, 256};
    t.groupSize = std::max(64u, device.mostSubgroupSize());
    t.groupRays = t.groups = std::min(4u, width);
    t.foundCapacity = 8192, t.chosenCapacity = 2048;
    t.pieceColumns = 512, t.pieceBeams = 2048, t.pieceRays = 1 << 19;
  }
  return t;
}

LightPass::LightPass(const Device& device, layout::uint falloff, layout::uint endpoint)
    : device_(device), queries_(device.createTimestampQueries(2)), falloff_(falloff), endpoint_(endpoint) {}

std::vector<SpecializationConstant> LightPass::constants(bool perspective, bool careful) const {
  const Tuning t = tuning(device_);
  return {{0, t.groupSize},
          {1, static_cast<std::uint32_t>(tree_->channels())},
          {2, perspective},
          {3, careful},
          {4, t.foundCapacity},
          {5, t.chosenCapacity},
          {6, device_.mostSubgroupSize()}};
}

const ComputePipeline& LightPass::gather(const GatherVariant& variant) {
  ComputePipeline& made = gathers_[variant];
  if (made.handle() == VK_NULL_HANDLE)
    made = device_.createComputePipeline(variant.exact ? spirv::light_gather_exact_comp : spirv::light_gather_comp,
                                         sizeof(layout::LightParams), constants(variant.perspective, variant.careful));
  return made;
}

const ComputePipeline& LightPass::sum(const SumVariant& variant) {
  ComputePipeline& made = sums_[variant];
  if (made.handle() != VK_NULL_HANDLE) return made;
  const Tuning t = tuning(device_);
  std::vector<SpecializationConstant> all = constants(variant.perspective, variant.careful);
  all.insert(all.end(), {{7, t.groupRays}, {8, t.groups}, {9, falloff_}, {10, endpoint_}, {11, variant.nearLight}});
  made = device_.createComputePipeline(spirv::light_sum_comp, sizeof(layout::LightParams), all);
  return made;
}

void LightPass::setTree(const Octree& tree) {
  tree_ = &tree;
  greatestRadius_ = tree.radius.empty() ? 0 : *std::max_element(tree.radius.begin(), tree.radius.end());
  gathers_.clear(), sums_.clear();
  nodes_ = {}, particles_ = {}, peaks_ = {};
  release();
  parts_.clear();
  loaded_ = 0;
  if (tree.particleCount() == 0) return;
  const auto end = static_cast<std::uint32_t>(tree.nodeCount());
  const auto partOf = [&](std::uint32_t first, std::uint64_t nodes) {
    const auto past = first + static_cast<std::uint32_t>(nodes);
    return Part{first, past, tree.nodes[first].first, tree.nodes[past].first};
  };
  const auto sizesFrom = [&](std::uint32_t first) {
    return [&, first](std::uint64_t nodes) { return partSizes(partOf(first, nodes)); };
  };
  const Tuning t = tuning(device_);
  const auto costOf = [&](const Extent& extent) {
    return arraysCost(device_, bufferSizes(extent)) + device_.stagingCost();
  };
  std::uint64_t beside = costOf({t.pieceColumns, t.pieceBeams, t.pieceRays});
  if (!arraysFit(device_, sizesFrom(0)(end), beside)) {
    // A quarter for the rays: more would pass the tree in more parts, less would leave much of a device idle. One
    // column must fit, with a quarter more rays and beams than it has as a rule.
    const std::size_t columnBeams = t.beams.columnRays / t.beams.beamRays;
    const std::uint64_t least = costOf({1, columnBeams + columnBeams / 4, t.beams.columnRays + t.beams.columnRays / 4});
    beside = std::min(beside, std::max(least, device_.budget().room() / 4));
  }
  for (std::uint32_t first = 0; first < end;) {
    const std::uint64_t nodes =
        partThatFits(device_, end - first, 1, sizesFrom(first), beside, "the octree and its rays");
    parts_.push_back(partOf(first, nodes));
    first = parts_.back().endNode;
  }
  loaded_ = parts_.size();
  if (parts_.size() > 1) logVerbose(fmt::format("octree: {} parts on the device", parts_.size()));
}

std::vector<std::uint64_t> LightPass::partSizes(const Part& part) const {
  const std::uint64_t slots = part.endSlot - part.firstSlot;
  return {(part.endNode - part.firstNode + std::uint64_t{1}) * sizeof(layout::Node), slots * sizeof(vec4),
          tree_->channels() * slots * sizeof(float)};
}

void LightPass::load(std::size_t part) {
  if (loaded_ == part) return;
  loaded_ = parts_.size();
  nodes_ = {}, particles_ = {}, peaks_ = {};
  const Part& own = parts_[part];
  // The node behind the last says where the last one's particles end, and a skip beyond it ends the walk.
  nodes_ = uploadEach<layout::Node>(device_, own.endNode - own.firstNode + 1, [&](std::size_t i) {
    layout::Node node = tree_->nodes[own.firstNode + i];
    node.first -= own.firstSlot, node.skip -= own.firstNode;
    return node;
  });
  const std::size_t count = own.endSlot - own.firstSlot;
  particles_ = uploadEach<vec4>(device_, count, [&](std::size_t i) {
    return vec4(tree_->position(own.firstSlot + i), tree_->radius[own.firstSlot + i]);
  });
  peaks_ = device_.createBuffer(tree_->channels() * count * sizeof(float));
  const std::vector<float>* peaks[] = {&tree_->peak, &tree_->peakGreen, &tree_->peakBlue};
  for (std::size_t c = 0; c < tree_->channels(); ++c)
    device_.upload<float>(peaks_, std::span(*peaks[c]).subspan(own.firstSlot, count), c * count);
  loaded_ = part;
}

std::vector<float> LightPass::opticalDepths(const layout::Light& light, const LightingOptions& options,
                                            const RaysDone& done) {
  return opticalDepths(slotsOf(*tree_), light, options, {}, done);
}

std::vector<float> LightPass::opticalDepths(const Receivers& receivers, const layout::Light& light,
                                            const LightingOptions& options, std::span<const std::uint8_t> reached,
                                            const RaysDone& done) {
  MOTE_CHECK(options.falloff, ==, falloff_);
  MOTE_CHECK(options.endpoint, ==, endpoint_);
  const std::size_t count = receivers.size();
  std::vector<float> depths(tree_->channels() * count, 0.0f);
  if (shadowless(light) || tree_->particleCount() == 0) return depths;
  const Tuning t = tuning(device_);
  const float limit = opticalDepthLimit(light, options);
  Beams beams;
  std::size_t passed = 0, reported = 0;  // rays: through one part each, through all parts
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    if (parts_.size() > 1) release();
    load(part);
    if (part == 0)
      beams = planBeams(receivers, light, reached, tree_->meanRadius, t.beams);
    else if (std::isfinite(limit))
      beams = planBeams(receivers, light, stillBright(depths, count, reached, limit), tree_->meanRadius, t.beams);
    for (std::size_t first = 0, last = 0; first < beams.columns(); first = last) {
      const auto extentTo = [&](std::size_t end) {
        return Extent{end - first, beams.column[end] - beams.column[first],
                      beams.start[beams.column[end]] - beams.start[beams.column[first]]};
      };
      const auto fits = [&](const Extent& e) {
        return e.columns <= t.pieceColumns && e.beams <= t.pieceBeams && e.rays <= t.pieceRays && hasRoom(e);
      };
      for (last = first + 1; last < beams.columns() && fits(extentTo(last + 1));) ++last;
      makeRoom(extentTo(last));
      const Piece piece = setUp(receivers, light, beams, first, last);
      const std::vector<float> sums = run(piece, limit);
      const std::size_t rays = piece.rays.size();
      for (std::size_t c = 0; c < tree_->channels(); ++c)
        for (std::size_t k = 0; k < rays; ++k) depths[c * count + piece.receivers[k]] += sums[c * rays + k];
      passed += rays;
      const std::size_t whole = passed / parts_.size();
      if (done) done(whole - std::exchange(reported, whole));
    }
  }
  return depths;
}

std::vector<std::uint8_t> LightPass::stillBright(std::span<const float> depths, std::size_t count,
                                                 std::span<const std::uint8_t> reached, float limit) const {
  std::vector<std::uint8_t> bright(count);
  parallelBlocks(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      float least = depths[k];
      for (std::size_t c = 1; c < tree_->channels(); ++c) least = std::min(least, depths[c * count + k]);
      bright[k] = (reached.empty() || reached[k] != 0) && !(least > limit) ? 1 : 0;
    }
  });
  return bright;
}

bool LightPass::hasRoom(const Extent& extent) const {
  if (extent.within(buffers_.room)) return true;
  const std::uint64_t held = buffers_.room.rays > 0 ? arraysCost(device_, bufferSizes(buffers_.room)) : 0;
  return arraysCost(device_, bufferSizes(extent)) + device_.stagingCost() <= device_.budget().room() + held;
}

void LightPass::makeRoom(const Extent& extent) {
  const Extent old = buffers_.room;
  if (extent.within(old)) return;
  release();
  // An eighth more where that fits: pieces differ, and so few of them make their buffers anew.
  const auto more = [](std::size_t had, std::size_t wanted) { return std::max(had, wanted + wanted / 8); };
  Extent room{more(old.columns, extent.columns), more(old.beams, extent.beams), more(old.rays, extent.rays)};
  if (!arraysFit(device_, bufferSizes(room), device_.stagingCost())) room = extent;
  const std::vector<std::uint64_t> sizes = bufferSizes(room);
  Buffers& to = buffers_;
  std::size_t k = 0;
  for (Buffer* buffer : {&to.columns, &to.planes, &to.walks, &to.beams, &to.rays, &to.depths, &to.found, &to.order,
                         &to.chosen, &to.chosenIndex})
    *buffer = device_.createBuffer(sizes[k++]);
  to.room = room;
}

std::vector<std::uint64_t> LightPass::bufferSizes(const Extent& e) const {
  const Tuning t = tuning(device_);
  const std::uint64_t bins = layout::kLightBins * (1 + device_.mostSubgroupSize());
  return {e.columns * sizeof(layout::LightColumn),
          8 * e.columns * sizeof(vec4),
          e.columns * sizeof(layout::LightWalk),
          e.beams * sizeof(layout::LightBeam),
          e.rays * sizeof(layout::LightRay),
          tree_->channels() * e.rays * sizeof(float),
          e.columns * layout::kFoundLists * t.foundCapacity * sizeof(vec4),
          e.columns * (layout::kOrderLists * t.foundCapacity + bins) * sizeof(layout::uint),
          e.beams * layout::kChosenLists * t.chosenCapacity * sizeof(vec4),
          e.beams * layout::kChosenLists * t.chosenCapacity * sizeof(layout::uint)};
}

LightPass::Piece LightPass::setUp(const Receivers& receivers, const layout::Light& light, const Beams& beams,
                                  std::size_t first, std::size_t last) const {
  const std::size_t firstBeam = beams.column[first], firstRay = beams.start[firstBeam];
  const std::size_t beamCount = beams.column[last] - firstBeam;
  Piece piece;
  piece.columns.resize(last - first), piece.planes.resize(8 * (last - first));
  piece.rays.resize(beams.start[beams.column[last]] - firstRay), piece.receivers.resize(piece.rays.size());
  const Part& part = parts_[loaded_];
  const Bounds bounds = tree_->bounds();
  const dvec3 amid(bounds.centre());
  const double reach = 0.5 * glm::length(dvec3(bounds.size()));
  const ColumnRules rules = columnRules(*tree_, light, receivers.bounds());
  std::vector<layout::LightBeam> headers(beamCount);
  std::vector<std::uint8_t> careful(beamCount);
  std::atomic<bool> exact = false;
  parallelBlocks(last - first, 1, [&](std::size_t at, std::size_t) {
    static thread_local Column column;
    static thread_local Beam beam;
    const std::size_t c = first + at;
    column.setRays(receivers, light, beams.ofColumn(c), rules);
    layout::LightColumn& header = piece.columns[at];
    header = headerOf(column, amid);
    if (column.precise || glm::distance(dvec3(header.middle), amid) + reach > kExactRadii * rules.leastRadius)
      exact = true;
    for (std::size_t k = 0; k < 8; ++k) {
      const ColumnPlanes& p = column.planes;
      piece.planes[8 * at + k] = vec4(p.x[k], p.y[k], p.z[k], p.offset[k]);
    }
    BeamBoxes boxes;
    const std::size_t begin = beams.column[c] - firstBeam, end = beams.column[c + 1] - firstBeam;
    for (std::size_t b = begin; b < end; ++b) {
      beam.setRays(column, receivers, beams.ofBeam(firstBeam + b));
      careful[b] = beam.careful;
      boxes.add(beam);
      layout::LightBeam& to = headers[b];
      to = headerOf(beam, column);
      to.firstRay = static_cast<layout::uint>(beams.start[firstBeam + b] - firstRay);
      to.rayCount = static_cast<layout::uint>(beam.rays.receiver.size());
      to.column = static_cast<layout::uint>(at);
      for (std::size_t k = 0; k < to.rayCount; ++k) {
        piece.rays[to.firstRay + k] = rayOf(beam.rays, k, part.firstSlot, part.endSlot);
        piece.receivers[to.firstRay + k] = beam.rays.receiver[k];
      }
    }
    boxes.store(header, std::span(headers).subspan(begin, end - begin));
  });
  for (std::size_t b = 0; b < beamCount; ++b) (careful[b] ? piece.careful : piece.plain).push_back(headers[b]);
  if (exact && !device_.hasFloat64())
    logVerbose("this device has no shaderFloat64: particles beyond 128 of the smallest radius are lit less exactly");
  piece.exact = exact && device_.hasFloat64();
  piece.perspective = light.type != layout::kLightDirectional;
  const vec3 away = light.position - glm::clamp(light.position, bounds.lo, bounds.hi);
  piece.nearLight = piece.perspective && glm::length(away) <= 1.001 * kNearLightRadii * greatestRadius_;
  return piece;
}

std::vector<float> LightPass::run(const Piece& piece, float limit) {
  const Tuning t = tuning(device_);
  const std::size_t columns = piece.columns.size(), rays = piece.rays.size();
  const std::size_t channels = tree_->channels();
  const Buffers& to = buffers_;
  device_.upload<layout::LightColumn>(to.columns, piece.columns);
  device_.upload<vec4>(to.planes, piece.planes);
  device_.upload<layout::LightRay>(to.rays, piece.rays);
  device_.upload<layout::LightWalk>(to.walks, std::vector<layout::LightWalk>(columns));
  device_.upload<float>(to.depths, std::vector<float>(channels * rays, 0.0f));

  const Part& part = parts_[loaded_];
  layout::LightParams params{};
  params.nodes = nodes_.address(), params.particles = particles_.address(), params.peaks = peaks_.address();
  params.columns = to.columns.address(), params.planes = to.planes.address(), params.walks = to.walks.address();
  params.beams = to.beams.address(), params.rays = to.rays.address(), params.opticalDepths = to.depths.address();
  params.found = to.found.address(), params.order = to.order.address(), params.chosen = to.chosen.address();
  params.chosenIndex = to.chosenIndex.address();
  params.nodeCount = part.endNode - part.firstNode;
  params.columnCount = static_cast<layout::uint>(columns);
  params.rayCount = static_cast<layout::uint>(rays);
  params.opticalDepthLimit = limit;
  params.slotCount = part.endSlot - part.firstSlot;

  const ComputePipeline& gathering = gather({piece.perspective, !piece.careful.empty(), piece.exact});
  // A subgroup may be as large as the device likes: enough workgroups for the largest, those beyond the last end.
  const std::size_t eachGroup = t.groupSize / device_.mostSubgroupSize();
  std::vector<layout::LightBeam> plain = piece.plain, careful = piece.careful;
  while (!plain.empty() || !careful.empty()) {
    queries_.reset();
    device_.upload<layout::LightBeam>(to.beams, plain);
    device_.upload<layout::LightBeam>(to.beams, careful, plain.size());
    device_.run([&](CommandBuffer& commands) {
      const std::uint32_t stage = queries_.begin(commands, "light");
      commands.dispatchRow(gathering, params, (columns + eachGroup - 1) / eachGroup);
      commands.barrier(barrier::computeToCompute);
      const auto addUp = [&](std::size_t first, std::size_t count, bool areCareful) {
        if (count == 0) return;
        layout::LightParams own = params;
        own.beams += first * sizeof(layout::LightBeam), own.beamCount = static_cast<layout::uint>(count);
        own.chosen += first * layout::kChosenLists * t.chosenCapacity * sizeof(vec4);
        own.chosenIndex += first * layout::kChosenLists * t.chosenCapacity * sizeof(layout::uint);
        commands.dispatchRow(sum({piece.perspective, areCareful, piece.nearLight}), own,
                             (count + eachGroup - 1) / eachGroup);
      };
      addUp(0, plain.size(), false);
      addUp(plain.size(), careful.size(), true);
      queries_.end(commands, stage);
    });
    for (const StageTime& stage : queries_.results()) deviceSeconds_ += stage.seconds;
    // Beams of columns whose walk has not come to its end go on.
    const auto walked = device_.download<layout::LightWalk>(to.walks, columns);
    const auto finished = [&](const layout::LightBeam& beam) {
      const layout::LightWalk& walk = walked[beam.column];
      return walk.slot >= walk.end && walk.node >= params.nodeCount;
    };
    std::erase_if(plain, finished), std::erase_if(careful, finished);
  }
  return device_.download<float>(to.depths, channels * rays);
}

}  // namespace mote
