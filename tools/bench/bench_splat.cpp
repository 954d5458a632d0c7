// mote bench splat: splats of four pixels' radius, in depth order, drawn by the rasteriser on TBB and by the splat
// pass.
#include "engine/passes/splat_pass.h"
#include "host/core/parallel.h"
#include "host/core/random.h"
#include "host/splat/small_splats.h"
#include "host/splat/splat.h"
#include "tools/bench/bench_picture.h"

namespace mote {
namespace {

constexpr int kWidth = 1280, kHeight = 720;
constexpr float kPixels = 4;    // radius of a splat
constexpr float kPeak = 0.05f;  // thin: a million of them have an optical depth of about 1, so every one counts

layout::SplatCamera viewCamera() {
  return makeSplatCamera(vec3(0), vec3(0, 0, -1), vec3(0, 1, 0), 40, 0.1f, 100, kWidth, kHeight,
                         layout::kFalloffSmooth);
}

/// Uniform over the picture and in depth from 2 to 4, so that all of them are seen at the same size.
std::vector<layout::SplatParticle> randomSplats(std::uint64_t count, const layout::SplatCamera& camera) {
  std::vector<layout::SplatParticle> splats(count);
  parallelBlocks(splats.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto uniform = [i](std::uint64_t dimension) { return uniformFloat(hashBits(0, i, dimension)); };
      const float depth = 2 + 2 * uniform(0);
      const vec2 image = (2.0f * vec2(uniform(1), uniform(2)) - 1.0f) * camera.halfExtent;
      splats[i] = {
          .position = camera.position + depth * (camera.forward + image.x * camera.right + image.y * camera.up),
          .radius = kPixels * camera.pixelSize * depth,
          .radiance = {uniform(3), uniform(4), uniform(5)},
          .peak = kPeak};
    }
  });
  return splats;
}

}  // namespace

void benchSplat(Bench& bench) {
  const layout::SplatCamera camera = viewCamera();
  const std::vector<layout::SplatParticle> splats = randomSplats(bench.count(), camera);
  Bounds bounds;
  for (const layout::SplatParticle& splat : splats) bounds.add(splat.position);
  const std::vector<layout::uint> order = sortByDepth(splats, camera, depthKeyScale(bounds, camera.position));
  const std::string name = fmt::format("splats of {} pixels' radius at {} × {}", kPixels, kWidth, kHeight);

  Image onHost;
  const Contender host{"rasteriser on TBB", [&] { onHost = rasterize(splats, order, camera, false); }};
  const Device* device = bench.device();
  if (!device) {
    bench.compare(name, "splats", host, std::nullopt, [&] { return plausible(onHost); });
    return;
  }
  const auto count = static_cast<std::uint32_t>(splats.size());
  const SplatPass pass(*device, camera.falloff, false);
  const SplatTarget target = pass.createTarget(kWidth, kHeight);
  // Small or not does not depend on the distance here: all or none are.
  const bool allSmall = smallSplatsFirst(splats, camera, 1, SplatPass::smallSide(*device)) == count;
  const std::uint32_t small = allSmall ? count : 0;
  const Buffer particles = device->createBufferWith(std::span(splats));
  const Buffer indices = device->createBufferWith(std::span(order));
  Image onDevice;
  const Contender splatPass{"splat pass on the device, with download", [&] {
                              pass.draw(target, particles, indices, count, camera, nullptr, {}, false, small);
                              onDevice = pass.download(target);
                            }};
  bench.compare(name, "splats", host, splatPass, [&] { return samePicture(onHost, onDevice); });
}

}  // namespace mote
