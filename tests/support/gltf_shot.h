// Shots in glTF, and scenes that import them.
#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "host/core/error.h"
#include "host/scene/scene_reader.h"
#include "host/solids/mesh.h"
#include "tests/support/contains.h"
#include "tests/support/gltf.h"
#include "tests/support/temp_folder.h"

namespace mote::test {

/// A folder with a glTF in it, and scenes that import it.
class Shot {
 public:
  explicit Shot(const std::string& bytes, const std::string& name = "shot.glb") : name_(name) {
    writeBytes(folder_.file(name), bytes);
  }
  std::string file(const std::string& name) const { return folder_.file(name); }
  /// `import`: members after "file"; `keys`: of the scene.
  Scene scene(const std::string& import = "", const std::string& keys = "") const {
    return parseScene(
        fmt::format(R"({{"particles":[{{"file":"x.prt"}}],"import":{{"file":"{}"{}}}{}}})", name_, import, keys),
        folder_.file("scene.json"));
  }
  /// What reading it says; "" if it is read.
  std::string error(const std::string& import = "", const std::string& keys = "") const {
    try {
      scene(import, keys);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }

 private:
  TempFolder folder_;
  std::string name_;
};

inline std::string errorOf(const std::string& members) { return Shot(gltf(members)).error(); }

/// Single precision of numbers up to 20.
inline void expectNear(const vec3& a, const vec3& b) {
  EXPECT_LE(glm::distance(a, b), 4e-6f) << a.x << " " << a.y << " " << a.z;
}

inline vec3 viewOf(const Camera& camera) { return glm::normalize(camera.target - camera.position); }

/// Turns by `degrees` about an axis (0: x).
inline std::string turn(int axis, double degrees) {
  double xyzw[4] = {0, 0, 0, std::cos(degrees * kPi / 360)};
  xyzw[axis] = std::sin(degrees * kPi / 360);
  return fmt::format(R"("rotation":[{},{},{},{}])", xyzw[0], xyzw[1], xyzw[2], xyzw[3]);
}

inline const std::string kLens =
    R"("cameras":[{"type":"perspective","name":"lens","perspective":{"yfov":0.7,"aspectRatio":1.5,)"
    R"("znear":0.25,"zfar":64}},{"type":"orthographic","orthographic":{"xmag":3,"ymag":2,)"
    R"("znear":0.5,"zfar":32}}],)";
inline const std::string kLights =
    R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","color":[1,0.5,0.25],"intensity":1366},)"
    R"({"type":"spot","name":"bulb","intensity":683,"spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}},)"
    R"({"type":"directional","intensity":341.5}]}},)";

inline std::string lightNode(const std::string& name, int light, const std::string& more = "") {
  return fmt::format(R"({{"name":"{}","extensions":{{"KHR_lights_punctual":{{"light":{}}}}}{}}})", name, light, more);
}

/// A camera under a turned and scaled parent, a light of each kind, two boxes one under the other.
inline std::string wholeShot() {
  return glb(
      gltf(kLens + kLights + boxMesh(168) +
           R"(,"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.25,0.5,0.75,1]}}],)"
           R"("scene":0,"scenes":[{"nodes":[0,2,3,4,5]}],"nodes":[)"
           R"({"name":"rig","translation":[1,2,3],)" +
           turn(1, 90) + R"(,"scale":[2,2,2],"children":[1]},{"name":"Camera","camera":0,"translation":[0,0,5]},)" +
           lightNode("Key Light", 0, R"(,"translation":[1,2,3],"scale":[9,9,9])") + "," +
           lightNode("", 1, R"(,"translation":[0,4,0],)" + turn(0, -90)) + "," + lightNode("Sun", 2) +
           R"(,{"name":"Box.001","mesh":0,"translation":[0,10,0],"scale":[2,1,1],"children":[6]},)"
           R"({"name":"Box.001","mesh":0,"translation":[1,0,0]}])"),
      boxBytes());
}

/// A camera node with one animation of `path`; `keys` are times, then values, in the buffer behind the box.
inline std::string moving(const std::string& path, const std::string& interpolation, const std::vector<float>& times,
                          const std::vector<float>& values,
                          const std::string& nodes = R"([{"name":"Camera","camera":0}])") {
  const std::size_t width = path == "rotation" ? 4 : 3;
  const std::string bytes = boxBytes() + bytesOf(times) + bytesOf(values);
  const std::string views =
      fmt::format(R"(,{{"buffer":0,"byteOffset":168,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}})",
                  4 * times.size(), 168 + 4 * times.size(), 4 * values.size());
  const std::string accessors = fmt::format(R"(,{{"bufferView":2,"componentType":5126,"count":{},"type":"SCALAR"}},)"
                                            R"({{"bufferView":3,"componentType":5126,"count":{},"type":"VEC{}"}})",
                                            times.size(), values.size() / width, width);
  return glb(gltf(kLens + boxMesh(bytes.size(), "", views, accessors) +
                  fmt::format(R"(,"scenes":[{{"nodes":[0]}}],"nodes":{},"animations":[{{"channels":[{{"sampler":0,)"
                              R"("target":{{"node":0,"path":"{}"}}}}],"samplers":[{{"input":2,"output":3,)"
                              R"("interpolation":"{}"}}]}}])",
                              nodes, path, interpolation)),
             bytes);
}

inline std::vector<Mesh> meshesOf(const Scene& scene) {
  return loadMeshes(scene.solids, std::vector<int>(scene.solids.size(), 1));
}

}  // namespace mote::test
