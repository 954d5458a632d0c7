#include "tools/bench/peers/density_grid.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/RayIntersector.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/core/bins.h"
#include "host/core/error.h"
#include "host/core/parallel.h"

namespace mote {
namespace {

constexpr int kLeaf = 8;           // OpenVDB's leaves are 8³ voxels
constexpr float kLeastRadius = 1;  // [voxels]: what is smaller falls between the samples
constexpr float kMostScaled = 4;   // [voxels]: balls up to that are scaled to keep their integral
constexpr std::size_t kTaskRays = 1024;

using Leaf = openvdb::FloatTree::LeafNodeType;
using Intersector = openvdb::tools::VolumeRayIntersector<openvdb::FloatGrid>;

/// A particle in voxels; the density at its middle [1 / voxel].
struct Ball {
  vec3 centre;
  float radius = 0, density = 0;
};

/// (1 − ρ²/r²)^(3/2): its integral along a chord is 3π/8 · r (1 − b²/r²)².
float profile(float square) {
  const float u = 1 - square;
  return u > 0 ? u * std::sqrt(u) : 0;
}

/// Calls visit(i, j, k, value) for the voxels [lo, hi] that a ball of density 1 covers.
template <class Visit>
void coveredVoxels(const Ball& ball, glm::ivec3 lo, glm::ivec3 hi, const Visit& visit) {
  lo = glm::max(lo, glm::ivec3(glm::ceil(ball.centre - ball.radius)));
  hi = glm::min(hi, glm::ivec3(glm::floor(ball.centre + ball.radius)));
  const float inverse = 1 / (ball.radius * ball.radius);
  for (int i = lo.x; i <= hi.x; ++i)
    for (int j = lo.y; j <= hi.y; ++j) {
      const float x = static_cast<float>(i) - ball.centre.x, y = static_cast<float>(j) - ball.centre.y;
      const float across = (x * x + y * y) * inverse;
      if (across >= 1) continue;
      for (int k = lo.z; k <= hi.z; ++k) {
        const float z = static_cast<float>(k) - ball.centre.z;
        visit(i, j, k, profile(across + z * z * inverse));
      }
    }
}

}  // namespace

struct DensityGrid::Grid {
  openvdb::FloatGrid::Ptr density;  // index space: voxels from `origin`
  vec3 origin{0};
  float voxel = 1;
};

DensityGrid::DensityGrid(const Octree& tree, const DensityGridOptions& options)
    : tree_(tree), options_(options), grid_(std::make_unique<Grid>()) {
  MOTE_CHECK(tree.channels(), ==, 1u);
  openvdb::initialize();
}

DensityGrid::~DensityGrid() = default;

void DensityGrid::build() {
  const Bounds bounds = tree_.bounds();
  const vec3 size = bounds.size();
  const float voxel = std::max({size.x, size.y, size.z}) / static_cast<float>(options_.size);
  const vec3 origin = bounds.lo - 2 * voxel;  // balls that are widened to a voxel reach a voxel further
  const glm::ivec3 leaves = glm::ivec3(glm::ceil((size / voxel + 4.0f) / static_cast<float>(kLeaf))) + 1;
  const std::size_t count = tree_.particleCount();

  std::vector<Ball> balls(count);
  parallelBlocks(count, kTaskRays, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float own = tree_.radius[i] / voxel, radius = std::max(own, kLeastRadius);
      const float peak = tree_.peak[i] * (own / radius) * (own / radius);
      Ball ball{(tree_.position(i) - origin) / voxel, radius, peak * 8 / (3 * std::numbers::pi_v<float> * radius)};
      if (radius <= kMostScaled) {
        // ∫ (1 − ρ²/r²)^(3/2) = π² r³ / 8
        float sum = 0;
        coveredVoxels(ball, glm::ivec3(0), leaves * kLeaf, [&](int, int, int, float value) { sum += value; });
        const float integral = std::numbers::pi_v<float> * std::numbers::pi_v<float> / 8 * radius * radius * radius;
        ball.density *= sum > 0 ? integral / sum : 0;
      }
      balls[i] = ball;
    }
  });
  const auto eachLeaf = [&](const Ball& ball, const auto& visit) {
    const glm::ivec3 lo = glm::max(glm::ivec3(glm::ceil(ball.centre - ball.radius)), 0) / kLeaf;
    const glm::ivec3 hi = glm::min(glm::ivec3(glm::floor(ball.centre + ball.radius)) / kLeaf, leaves - 1);
    for (int x = lo.x; x <= hi.x; ++x)
      for (int y = lo.y; y <= hi.y; ++y)
        for (int z = lo.z; z <= hi.z; ++z)
          visit((std::size_t(x) * std::size_t(leaves.y) + std::size_t(y)) * std::size_t(leaves.z) + std::size_t(z));
  };
  const Binned<std::uint32_t> bins = sortIntoBins<std::uint32_t>(
      count, std::size_t(leaves.x) * std::size_t(leaves.y) * std::size_t(leaves.z),
      [&](std::size_t begin, std::size_t end, const auto& put) {
        for (std::size_t i = begin; i < end; ++i)
          eachLeaf(balls[i], [&](std::size_t leaf) { put(leaf, static_cast<std::uint32_t>(i)); });
      });

  // The leaves are made one after the other, which the tree demands, and filled all at once.
  grid_->density = openvdb::FloatGrid::create(0);
  grid_->origin = origin, grid_->voxel = voxel;
  openvdb::FloatTree& tree = grid_->density->tree();
  std::vector<std::pair<Leaf*, std::size_t>> work;
  for (std::size_t bin = 0; bin < bins.bins(); ++bin) {
    if (bins.of(bin).empty()) continue;
    const std::size_t z = bin % std::size_t(leaves.z), y = bin / std::size_t(leaves.z) % std::size_t(leaves.y),
                      x = bin / std::size_t(leaves.z) / std::size_t(leaves.y);
    work.emplace_back(tree.touchLeaf(openvdb::Coord(int(x) * kLeaf, int(y) * kLeaf, int(z) * kLeaf)), bin);
  }
  parallelBlocks(work.size(), 1, [&](std::size_t w, std::size_t) {
    const auto& [leaf, bin] = work[w];
    const openvdb::Coord corner = leaf->origin();
    const glm::ivec3 lo(corner.x(), corner.y(), corner.z());
    float* const voxels = leaf->buffer().data();
    for (const std::uint32_t item : bins.of(bin)) {
      const Ball& ball = balls[item];
      coveredVoxels(ball, lo, lo + (kLeaf - 1), [&](int x, int y, int z, float value) {
        voxels[((x - lo.x) * kLeaf + (y - lo.y)) * kLeaf + (z - lo.z)] += ball.density * value;
      });
    }
    leaf->setValuesOn();
  });
}

std::vector<float> DensityGrid::opticalDepths(const layout::Light& light, const LightingOptions& options) const {
  using openvdb::Vec3d;
  const std::size_t count = tree_.particleCount();
  const float limit = opticalDepthLimit(light, options);
  const bool directional = light.type == layout::kLightDirectional;
  const Grid& grid = *grid_;
  const Intersector master(*grid.density, 1);  // leaves dilated by a voxel, which trilinear samples reach
  std::vector<float> depths(count);
  parallelBlocks(count, kTaskRays, [&](std::size_t begin, std::size_t end) {
    Intersector intersector(master);
    auto accessor = grid.density->getConstAccessor();
    for (std::size_t i = begin; i < end; ++i) {
      const vec3 start = (tree_.position(i) - grid.origin) / grid.voxel;
      const vec3 toLight = directional ? -light.direction : (light.position - grid.origin) / grid.voxel - start;
      const double length = directional ? 1e9 : double(glm::length(toLight));
      if (length <= 0) continue;
      const vec3 d = glm::normalize(toLight);
      const Vec3d eye(start.x, start.y, start.z), direction(d.x, d.y, d.z);
      const float own = tree_.radius[i] / grid.voxel, radius = std::max(own, kLeastRadius);
      double depth = -0.5 * double(tree_.peak[i] * (own / radius) * (own / radius));
      double from = 0, to = 0;
      if (intersector.setIndexRay(openvdb::math::Ray<double>(eye, direction, 0, length)))
        while (depth <= double(limit) && intersector.march(from, to)) {
          // Middles of whole steps, shrunk to fill the stretch.
          const int steps = std::max(1, static_cast<int>(std::ceil((to - from) / double(options_.step))));
          const double step = (to - from) / steps;
          double sum = 0;
          for (int s = 0; s < steps; ++s)
            sum += double(openvdb::tools::BoxSampler::sample(accessor, eye + direction * (from + (s + 0.5) * step)));
          depth += sum * step;
        }
      depths[i] = static_cast<float>(std::max(depth, 0.0));
    }
  });
  return depths;
}

}  // namespace mote
