#include "engine/passes/light_pass.h"

#include <algorithm>
#include <array>
#include <atomic>

#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/lighting/beam.h"
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

/// Points as (x, y, z, w) with w from `fourth`, interleaved in pieces: no second copy of all on the host.
Buffer uploadPoints(const Device& device, const Receivers& points, std::span<const float> fourth) {
  constexpr std::size_t kPiece = 1 << 20;
  Buffer buffer = device.createBuffer(points.size() * sizeof(vec4));
  std::vector<vec4> piece;
  for (std::size_t begin = 0; begin < points.size(); begin += kPiece) {
    piece.resize(std::min(kPiece, points.size() - begin));
    parallelBlocks(piece.size(), 1 << 14, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) piece[i] = vec4(points.position(begin + i), fourth[begin + i]);
    });
    device.upload<vec4>(buffer, piece, begin);
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

layout::LightRay rayOf(const BeamRays& rays, std::size_t k) {
  return {rays.u[k], rays.v[k], rays.depth[k], rays.self[k], rays.uLow[k], rays.vLow[k], rays.depthLow[k]};
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

std::uint64_t LightPass::Buffers::bytes() const {
  std::uint64_t sum = 0;
  for (const Buffer* buffer :
       {&columns, &planes, &walks, &beams, &rays, &depths, &found, &order, &chosen, &chosenIndex})
    sum += buffer->size();
  return sum;
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
  const std::size_t count = tree.particleCount();
  nodes_ = device_.createBufferWith<layout::Node>(tree.nodes);
  peaks_ = device_.createBuffer(tree.channels() * count * sizeof(float));
  const std::vector<float>* peaks[] = {&tree.peak, &tree.peakGreen, &tree.peakBlue};
  for (std::size_t c = 0; c < tree.channels(); ++c)
    device_.upload<float>(peaks_, std::span(*peaks[c]).first(count), c * count);
  particles_ = uploadPoints(device_, slotsOf(tree), tree.radius);
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
  const Beams beams = planBeams(receivers, light, reached, tree_->meanRadius, t.beams);
  const float limit = opticalDepthLimit(light, options);
  for (std::size_t first = 0, last = 0; first < beams.columns(); first = last) {
    const auto fits = [&](std::size_t end) {
      return end - first <= t.pieceColumns && beams.column[end] - beams.column[first] <= t.pieceBeams &&
             beams.start[beams.column[end]] - beams.start[beams.column[first]] <= t.pieceRays;
    };
    for (last = first + 1; last < beams.columns() && fits(last + 1);) ++last;
    const Piece piece = setUp(receivers, light, beams, first, last);
    const std::vector<float> sums = run(piece, limit);
    const std::size_t rays = piece.rays.size();
    for (std::size_t c = 0; c < tree_->channels(); ++c)
      for (std::size_t k = 0; k < rays; ++k) depths[c * count + piece.receivers[k]] = sums[c * rays + k];
    if (done) done(rays);
  }
  return depths;
}

LightPass::Piece LightPass::setUp(const Receivers& receivers, const layout::Light& light, const Beams& beams,
                                  std::size_t first, std::size_t last) const {
  const std::size_t firstBeam = beams.column[first], firstRay = beams.start[firstBeam];
  const std::size_t beamCount = beams.column[last] - firstBeam;
  Piece piece;
  piece.columns.resize(last - first), piece.planes.resize(8 * (last - first));
  piece.rays.resize(beams.start[beams.column[last]] - firstRay), piece.receivers.resize(piece.rays.size());
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
        piece.rays[to.firstRay + k] = rayOf(beam.rays, k);
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
  const auto grow = [&](Buffer& buffer, std::size_t bytes) {
    if (buffer.size() < bytes) buffer = device_.createBuffer(bytes + bytes / 8);
  };
  const std::size_t columns = piece.columns.size(), beams = piece.plain.size() + piece.careful.size(),
                    rays = piece.rays.size();
  const std::size_t channels = tree_->channels();
  Buffers& to = buffers_;
  grow(to.columns, columns * sizeof(layout::LightColumn)), grow(to.planes, 8 * columns * sizeof(vec4));
  grow(to.walks, columns * sizeof(layout::LightWalk)), grow(to.beams, beams * sizeof(layout::LightBeam));
  grow(to.rays, rays * sizeof(layout::LightRay)), grow(to.depths, channels * rays * sizeof(float));
  grow(to.found, columns * layout::kFoundLists * t.foundCapacity * sizeof(vec4));
  grow(to.order, columns *
                     (layout::kOrderLists * t.foundCapacity + layout::kLightBins * (1 + device_.mostSubgroupSize())) *
                     sizeof(layout::uint));
  grow(to.chosen, beams * layout::kChosenLists * t.chosenCapacity * sizeof(vec4));
  grow(to.chosenIndex, beams * layout::kChosenLists * t.chosenCapacity * sizeof(layout::uint));
  deviceBytes_ = std::max(deviceBytes_, nodes_.size() + particles_.size() + peaks_.size() + to.bytes());
  device_.upload<layout::LightColumn>(to.columns, piece.columns);
  device_.upload<vec4>(to.planes, piece.planes);
  device_.upload<layout::LightRay>(to.rays, piece.rays);
  device_.upload<layout::LightWalk>(to.walks, std::vector<layout::LightWalk>(columns));
  device_.upload<float>(to.depths, std::vector<float>(channels * rays, 0.0f));

  layout::LightParams params{};
  params.nodes = nodes_.address(), params.particles = particles_.address(), params.peaks = peaks_.address();
  params.columns = to.columns.address(), params.planes = to.planes.address(), params.walks = to.walks.address();
  params.beams = to.beams.address(), params.rays = to.rays.address(), params.opticalDepths = to.depths.address();
  params.found = to.found.address(), params.order = to.order.address(), params.chosen = to.chosen.address();
  params.chosenIndex = to.chosenIndex.address();
  params.nodeCount = static_cast<layout::uint>(tree_->nodeCount());
  params.columnCount = static_cast<layout::uint>(columns);
  params.rayCount = static_cast<layout::uint>(rays);
  params.opticalDepthLimit = limit;
  params.slotCount = static_cast<layout::uint>(tree_->particleCount());

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
