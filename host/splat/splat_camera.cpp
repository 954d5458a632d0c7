#include <cmath>

#include "host/core/error.h"
#include "host/splat/splat.h"

namespace mote {

layout::SplatCamera makeSplatCamera(const vec3& position, const vec3& target, const vec3& up, float fov, float near,
                                    float far, int width, int height, layout::uint falloff) {
  MOTE_CHECK(width, >, 0);
  MOTE_CHECK(height, >, 0);
  // In double: the axes are then unit and orthogonal to float's last digit.
  const dvec3 view = dvec3(target) - dvec3(position);
  const double distance = glm::length(view);
  if (!(distance > 0))
    throw InputError("camera", "target", "a point away from the position",
                     fmt::format("both at ({}, {}, {})", position.x, position.y, position.z));
  const dvec3 forward = view / distance;
  const dvec3 side = glm::cross(forward, dvec3(up));
  const double sine = glm::length(side);
  if (!(sine > 1e-6 * glm::length(dvec3(up))))  // nearer than that the picture's roll is rounding noise
    throw InputError("camera", "up", "a direction not parallel to the view",
                     fmt::format("({}, {}, {})", up.x, up.y, up.z));
  const dvec3 right = side / sine;

  layout::SplatCamera camera{};
  camera.right = right;
  camera.up = glm::cross(right, forward);
  camera.forward = forward;
  camera.position = position;
  camera.near = near;
  camera.far = far;
  camera.falloff = falloff;
  camera.pixelSize = static_cast<float>(2 * std::tan(fov * kPi / 360) / height);
  camera.imageSize = vec2(width, height);
  camera.halfExtent = 0.5f * camera.pixelSize * camera.imageSize;
  camera.minRadius = kMinSplatRadius;
  camera.pixelAspect = 1;
  camera.focusDistance = 1;
  return camera;
}

void makeOrthographic(layout::SplatCamera& camera, float height) {
  camera.orthographic = 1;
  camera.pixelSize = height / camera.imageSize.y;
  camera.halfExtent = 0.5f * camera.pixelSize * vec2(camera.imageSize.x * camera.pixelAspect, camera.imageSize.y);
}

void setPixelAspect(layout::SplatCamera& camera, float aspect) {
  camera.pixelAspect = aspect;
  camera.halfExtent.x = 0.5f * camera.pixelSize * (camera.imageSize.x * aspect);
}

mat4 worldToCamera(const layout::SplatCamera& camera) {
  const dvec3 axes[] = {camera.right, camera.up, camera.forward};
  mat4 m(1);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m[column][row] = static_cast<float>(axes[row][column]);
    m[3][row] = static_cast<float>(-glm::dot(axes[row], dvec3(camera.position)));
  }
  return m;
}

mat4 worldToNdc(const layout::SplatCamera& camera) {
  // x_ndc = ½ + ½·(x/z) / halfWidth, y_ndc = ½ − ½·(y/z) / halfHeight, both times w = z; z_ndc = 1 at far, 0 at near.
  mat4 projection(0);
  projection[0][0] = 0.5f / camera.halfExtent.x;
  projection[1][1] = -0.5f / camera.halfExtent.y;
  if (camera.orthographic != 0) {  // w = 1
    projection[2][2] = 1 / (camera.far - camera.near);
    projection[3] = vec4(0.5f, 0.5f, -camera.near * projection[2][2], 1);
  } else {
    projection[2] = vec4(0.5f, 0.5f, camera.far / (camera.far - camera.near), 1);
    projection[3][2] = -camera.near * projection[2][2];
  }
  return projection * worldToCamera(camera);
}

}  // namespace mote
