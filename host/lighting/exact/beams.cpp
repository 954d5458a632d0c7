#include "host/lighting/exact/beams.h"

#include <tbb/task_group.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/core/bins.h"

namespace mote {
namespace {

constexpr int kFaces = 6;
/// Columns and beams wider than this many typical radii are cut even if they have few rays.
constexpr float kWidestColumn = 8, kWidestBeam = 6;
/// Rays are first counted into at most this many cells, by this many blocks: 1 MiB of counts.
constexpr std::size_t kMostCells = 4096, kBlocks = 64;
/// Rays a cell that the first pass aims at: what sorts within the second cache.
constexpr std::size_t kCellRays = 2048;
/// Above this many rays two halves are cut by two tasks.
constexpr std::size_t kTaskRays = 1 << 14;

/// Where a ray crosses its face; `face` kNone: no ray.
struct Crossing {
  float u, v;
  std::uint32_t receiver;
};
constexpr std::uint8_t kNone = 0xff;

/// Coordinates of a ray's direction (point lights: on a cube's face, −1 to 1) or of its line (directional: scene
/// units).
class Faces {
 public:
  Faces(const layout::Light& light, const vec3& centre) : directional_(light.type == layout::kLightDirectional) {
    origin_ = directional_ ? centre : light.position;
    const vec3 d = light.direction;
    u_ = glm::normalize(glm::cross(d, std::abs(d.x) < 0.6f ? vec3(1, 0, 0) : vec3(0, 1, 0)));
    v_ = glm::cross(d, u_);
  }

  std::uint8_t cross(const vec3& point, float& u, float& v) const {
    const vec3 p = point - origin_;
    if (directional_) {
      u = glm::dot(p, u_), v = glm::dot(p, v_);
      return 0;
    }
    const vec3 a = glm::abs(p);
    const int axis = a.x >= a.y ? (a.x >= a.z ? 0 : 2) : (a.y >= a.z ? 1 : 2);
    if (a[axis] == 0) return kNone;
    const float inverse = 1 / a[axis];
    u = p[(axis + 1) % 3] * inverse, v = p[(axis + 2) % 3] * inverse;
    return static_cast<std::uint8_t>(2 * axis + (p[axis] < 0));
  }

  /// What a length at the receiver's place is in the face's coordinates.
  float scaleAt(const vec3& point) const {
    if (directional_) return 1;
    const vec3 a = glm::abs(point - origin_);
    return 1 / std::max({a.x, a.y, a.z});
  }

 private:
  bool directional_;
  vec3 origin_, u_, v_;
};

/// A rectangle of a face cut into cells.
struct CellGrid {
  vec2 lo{std::numeric_limits<float>::infinity()}, hi{-std::numeric_limits<float>::infinity()};
  std::size_t columns = 0, rows = 0, first = 0;  ///< first: number of the cells of the faces before
  vec2 scale{0};

  void add(float u, float v) { lo = glm::min(lo, vec2(u, v)), hi = glm::max(hi, vec2(u, v)); }
  void add(const CellGrid& other) { lo = glm::min(lo, other.lo), hi = glm::max(hi, other.hi); }
  bool empty() const { return !(lo.x <= hi.x); }
  float width() const { return std::max(hi.x - lo.x, hi.y - lo.y); }
  /// About `cells` of them, nearly square.
  void divide(std::size_t cells, std::size_t firstCell) {
    first = firstCell;
    if (empty()) return;
    const vec2 size = glm::max(hi - lo, vec2(1e-30f));
    const double aspect = std::clamp(double(size.x) / double(size.y), 1.0 / double(cells), double(cells));
    columns = std::clamp<std::size_t>(static_cast<std::size_t>(std::sqrt(double(cells) * aspect)), 1, cells);
    rows = std::max<std::size_t>(cells / columns, 1);
    scale = vec2(static_cast<float>(columns), static_cast<float>(rows)) / size;
  }
  std::size_t cell(float u, float v) const {
    const auto column = std::min(static_cast<std::size_t>((u - lo.x) * scale.x), columns - 1);
    const auto row = std::min(static_cast<std::size_t>((v - lo.y) * scale.y), rows - 1);
    // Every other row backwards: neighbours in the list are neighbours in space.
    return first + row * columns + (row % 2 == 0 ? column : columns - 1 - column);
  }
};

template <float Crossing::*kField>
struct Before {
  bool operator()(const Crossing& a, const Crossing& b) const {
    return a.*kField != b.*kField ? a.*kField < b.*kField : a.receiver < b.receiver;
  }
};

/// What begins at a crossing.
constexpr std::uint8_t kBeamBegins = 1, kColumnBegins = 2;

/// Bins of a coordinate that a range is split by: groups of equal count to within what a bin holds.
constexpr std::size_t kSplitBins = 1024;

CellGrid boxOf(const Crossing* begin, const Crossing* end) {
  CellGrid box;
  for (const Crossing* ray = begin; ray != end; ++ray) box.add(ray->u, ray->v);
  return box;
}

/// Puts a range into groups of about equal count by one coordinate between lo and hi, in their order; returns where
/// each begins, and the end. Two passes, no comparisons.
template <float Crossing::*kField>
std::vector<std::size_t> splitEvenly(Crossing* begin, Crossing* end, float lo, float hi, std::size_t groups) {
  static thread_local std::vector<Crossing> copy;
  const auto count = static_cast<std::size_t>(end - begin);
  if (groups <= 1) return {0, count};
  copy.assign(begin, end);
  const float scale = hi > lo ? static_cast<float>(kSplitBins) / (hi - lo) : 0;
  const auto binOf = [&](const Crossing& ray) {
    return std::min(static_cast<std::size_t>((ray.*kField - lo) * scale), kSplitBins - 1);
  };
  std::array<std::uint32_t, kSplitBins> place{};
  for (const Crossing& ray : copy) ++place[binOf(ray)];
  std::vector<std::size_t> starts{0};
  std::size_t at = 0;
  for (std::uint32_t& bin : place) {
    if (at < count && at > starts.back() && at * groups >= starts.size() * count) starts.push_back(at);
    at += std::exchange(bin, static_cast<std::uint32_t>(at));
  }
  starts.push_back(count);
  for (const Crossing& ray : copy) begin[place[binOf(ray)]++] = ray;
  return starts;
}

/// Cuts ranges of crossings into columns and beams and marks where each begins.
class Cutter {
 public:
  Cutter(const Receivers& receivers, const Faces& faces, double radius, const BeamLimits& limits,
         std::vector<std::uint8_t>& begins, const Crossing* all)
      : receivers_(receivers),
        faces_(faces),
        radius_(static_cast<float>(radius)),
        limits_(limits),
        begins_(begins),
        all_(all) {}

  void cutIntoColumns(Crossing* begin, Crossing* end) const {
    const auto count = static_cast<std::size_t>(end - begin);
    if (count == 0) return;
    const CellGrid box = boxOf(begin, end);
    if (count == 1 || (count <= limits_.columnRays && box.width() <= kWidestColumn * radiusAt(*begin))) {
      mark(begin) |= kColumnBegins;
      cutIntoStrips(begin, end, box);
      return;
    }
    Crossing* middle = halve(begin, end, box);
    if (count < kTaskRays) {
      cutIntoColumns(begin, middle), cutIntoColumns(middle, end);
      return;
    }
    tbb::task_group tasks;
    tasks.run([&] { cutIntoColumns(begin, middle); });
    cutIntoColumns(middle, end);
    tasks.wait();
  }

 private:
  /// Strips across u, beams along each (sort-tile-recursive), nearly square and of equal count.
  void cutIntoStrips(Crossing* begin, Crossing* end, const CellGrid& box) const {
    const auto count = static_cast<std::size_t>(end - begin);
    const std::size_t beams = (count + limits_.beamRays - 1) / limits_.beamRays;
    const vec2 size = glm::max(box.hi - box.lo, vec2(1e-30f));
    const double across = std::sqrt(static_cast<double>(beams) * size.x / size.y);
    const std::size_t strips = std::clamp<std::size_t>(static_cast<std::size_t>(across + 0.5), 1, beams);
    const auto starts = splitEvenly<&Crossing::u>(begin, end, box.lo.x, box.hi.x, strips);
    for (std::size_t s = 0; s + 1 < starts.size(); ++s) {
      Crossing *strip = begin + starts[s], *stripEnd = begin + starts[s + 1];
      const std::size_t inStrip = starts[s + 1] - starts[s];
      const auto pieces = splitEvenly<&Crossing::v>(strip, stripEnd, box.lo.y, box.hi.y,
                                                    (inStrip + limits_.beamRays - 1) / limits_.beamRays);
      for (std::size_t p = 0; p + 1 < pieces.size(); ++p) cutIntoBeams(strip + pieces[p], strip + pieces[p + 1]);
    }
  }

  /// Halves what is still too wide, or too many for one bin to tell apart.
  void cutIntoBeams(Crossing* begin, Crossing* end) const {
    const auto count = static_cast<std::size_t>(end - begin);
    const CellGrid box = boxOf(begin, end);
    if (count == 1 ||
        (count <= limits_.beamRays + limits_.beamRays / 4 && box.width() <= kWidestBeam * radiusAt(*begin))) {
      mark(begin) |= kBeamBegins;
      return;
    }
    Crossing* middle = halve(begin, end, box);
    cutIntoBeams(begin, middle), cutIntoBeams(middle, end);
  }

  static Crossing* halve(Crossing* begin, Crossing* end, const CellGrid& box) {
    Crossing* middle = begin + (end - begin) / 2;
    if (box.hi.x - box.lo.x >= box.hi.y - box.lo.y)
      std::nth_element(begin, middle, end, Before<&Crossing::u>());
    else
      std::nth_element(begin, middle, end, Before<&Crossing::v>());
    return middle;
  }
  std::uint8_t& mark(const Crossing* begin) const { return begins_[static_cast<std::size_t>(begin - all_)]; }
  /// The typical radius in the face's coordinates.
  float radiusAt(const Crossing& ray) const { return radius_ * faces_.scaleAt(receivers_.position(ray.receiver)); }

  const Receivers& receivers_;
  const Faces& faces_;
  float radius_;
  BeamLimits limits_;
  std::vector<std::uint8_t>& begins_;
  const Crossing* all_;
};

/// All crossings, cell after cell.
Binned<Crossing> sortIntoCells(const Receivers& receivers, const Faces& faces, std::span<const std::uint8_t> reached) {
  const std::size_t count = receivers.size(), block = std::max<std::size_t>((count + kBlocks - 1) / kBlocks, 1);
  const auto each = [&](std::size_t begin, std::size_t end, const auto& body) {
    for (std::size_t k = begin; k < end; ++k) {
      if (!reached.empty() && reached[k] == 0) continue;
      float u, v;
      const std::uint8_t face = faces.cross(receivers.position(k), u, v);
      if (face != kNone) body(face, Crossing{u, v, static_cast<std::uint32_t>(k)});
    }
  };
  // Extent and count of each face.
  struct FaceCount {
    CellGrid grid;
    std::size_t rays = 0;
  };
  std::vector<std::array<FaceCount, kFaces>> parts(kBlocks);
  parallelBlocks(count, block, [&](std::size_t begin, std::size_t end) {
    each(begin, end, [&part = parts[begin / block]](std::uint8_t face, const Crossing& ray) {
      part[face].grid.add(ray.u, ray.v);
      ++part[face].rays;
    });
  });
  std::array<CellGrid, kFaces> grids;
  std::size_t cells = 0, rays = 0;
  for (int face = 0; face < kFaces; ++face) {
    std::size_t onFace = 0;
    for (const auto& part : parts) grids[face].add(part[face].grid), onFace += part[face].rays;
    grids[face].divide(std::clamp<std::size_t>(onFace / kCellRays, 1, kMostCells / kFaces), cells);
    cells += grids[face].columns * grids[face].rows;
    rays += onFace;
  }
  return sortIntoBins<Crossing>(count, cells, [&](std::size_t begin, std::size_t end, const auto& put) {
    each(begin, end, [&](std::uint8_t face, const Crossing& ray) { put(grids[face].cell(ray.u, ray.v), ray); });
  });
}

}  // namespace

Beams planBeams(const Receivers& receivers, const layout::Light& light, std::span<const std::uint8_t> reached,
                double typicalRadius, const BeamLimits& limits) {
  const Faces faces(light, receivers.bounds().centre());
  Binned<Crossing> cells = sortIntoCells(receivers, faces, reached);
  if (cells.items.empty()) return {};
  std::vector<std::uint8_t> begins(cells.items.size(), 0);
  const Cutter cutter(receivers, faces, typicalRadius, limits, begins, cells.items.data());
  parallelBlocks(cells.bins(), 1, [&](std::size_t cell, std::size_t) {
    cutter.cutIntoColumns(cells.items.data() + cells.start[cell], cells.items.data() + cells.start[cell + 1]);
  });
  Beams beams;
  beams.receiver.resize(cells.items.size());
  for (std::size_t i = 0; i < cells.items.size(); ++i) {
    if (begins[i] & kColumnBegins) beams.column.push_back(static_cast<std::uint32_t>(beams.start.size()));
    if (begins[i] & kBeamBegins) beams.start.push_back(static_cast<std::uint32_t>(i));
    beams.receiver[i] = cells.items[i].receiver;
  }
  beams.column.push_back(static_cast<std::uint32_t>(beams.start.size()));
  beams.start.push_back(static_cast<std::uint32_t>(beams.receiver.size()));
  return beams;
}

}  // namespace mote
