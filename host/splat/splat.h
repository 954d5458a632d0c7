// The view's half of the model: particles as camera-facing splats, blended back to front (DESIGN §2, §4.7 of the
// thesis), and the reference rasteriser on TBB that needs no Vulkan.
//
// At a pixel whose ray passes the centre at distance b a particle has α = 1 − e^(−peak · F(b²/r²)) and radiance
// α · source radiance; pixels are sampled at their centres. A splat smaller than `minRadius` pixels is stretched to it
// and its α multiplied by the ratio of areas: the total opacity over the picture stays, whatever the resolution.
//
// Depth layer Z: distance along the view axis [scene units] of the nearest particle centre whose splat has
// α ≥ kDepthAlpha at the pixel, kNoDepth where there is none: the front of the medium, not an average.
#pragma once
#include <span>
#include <vector>

#include "host/image/image.h"
#include "host/splat/splats_done.h"
#include "shaders/glsl/layout/sort.h"
#include "shaders/glsl/layout/splat.h"

namespace mote {

constexpr float kDepthAlpha = 1e-3f;
/// Smallest splat radius [pixels]. Averaged over where in a pixel a particle falls, the sum of its pixels is its
/// integral exactly, whatever the radius; a single one is off by sampling. Worst of 62,500 places [%] for a peak τ of
/// 0.01 · 1 · 5; the root mean square is about a third of it:
///             smooth            linear            sphere
///     1       7.4 · 21 · 50     12 · 24 · 54      52 · 57 · 65
///     1.25    13 · 19 · 22      9.9 · 8.6 · 9.6   11 · 14 · 23
///     1.5     3.1 · 2.6 · 11    11 · 12 · 23      25 · 30 · 40
///     2       1.5 · 1.8 · 4.7   1.9 · 3.0 · 9.3   13 · 16 · 24
///     3       0.4 · 0.6 · 1.1   0.8 · 1.3 · 3.4   4.8 · 5.9 · 10
/// 2 is the least that keeps the default falloff within 2 % for τ ≤ 1. splat_test measures its row through rasterize().
constexpr float kMinSplatRadius = 2.0f;

/// Camera space and image plane of a perspective camera with square pixels and everything sharp. `fov` vertical
/// [degrees]; `up` not parallel to the view. Throws InputError where target or up leave the view undefined.
layout::SplatCamera makeSplatCamera(const vec3& position, const vec3& target, const vec3& up, float fov, float near,
                                    float far, int width, int height, layout::uint falloff);

/// The same camera with parallel rays: `height` of the picture [scene units].
void makeOrthographic(layout::SplatCamera& camera, float height);
/// … with pixels `aspect` times as wide as high.
void setPixelAspect(layout::SplatCamera& camera, float aspect);

/// Scene → camera space (x right, y up, z forward) and, after division by w, scene → picture ((0,0) upper left, (1,1)
/// lower right; z 0 at near, 1 at far), for column vectors: what ExrOptions takes.
mat4 worldToCamera(const layout::SplatCamera& camera);
mat4 worldToNdc(const layout::SplatCamera& camera);

/// The unit view axis of an orthographic camera, 0 of a perspective one: what tells depthKey() which distance counts.
vec3 viewAxis(const layout::SplatCamera& camera);

/// Key of the sort: the bits of the squared distance to the camera, inverted, so that ascending order is back to front;
/// with a view axis, of the depth along it (0 for what lies behind).
/// `scale` is a power of two near 1 / (greatest distance): neither tiny nor huge scenes lose digits. The operations are
/// those of layout/sort.h, so it is bit-equal to depth_key.comp.
layout::uint depthKey(const vec3& particle, const vec3& camera, float scale, const vec3& axis = vec3(0));
/// The power of two that brings the farthest corner of `centres` to a distance in [½, 1); 1 where there is none.
float depthKeyScale(const Bounds& centres, const vec3& camera);

/// Indices of the particles back to front: ascending (depthKey, index), as std::stable_sort by distance would give.
std::vector<layout::uint> sortByDepth(std::span<const layout::SplatParticle> particles,
                                      const layout::SplatCamera& camera, float scale);

/// Draws the particles of a perspective camera with square pixels in the order given (indices into `particles`), each
/// α·radiance *over* what is there. Results do not depend on the number of threads nor on the CPU's instruction set,
/// bit for bit. Memory: the picture and at most 150 MB. A million splats of 4 pixels' radius take about half a second
/// of one core with AVX-512, spread over all cores.
Image rasterize(std::span<const layout::SplatParticle> particles, std::span<const layout::uint> order,
                const layout::SplatCamera& camera, bool withDepth, const SplatsDone& done = {});

}  // namespace mote
