// A shot in glTF: its camera with its motion, its lights, and where its solids stand (their triangles are Assimp's).
#include "host/scene/gltf/gltf_import.h"

#include "tests/fuzz/fuzz.h"

namespace mote::fuzz {

void lookAt(const std::string& path, std::span<const std::byte>) {
  ImportOptions all, noCamera;
  all.file = noCamera.file = path;
  noCamera.camera = false;  // a damaged one keeps nobody from the rest
  mayRefuse(path, [&] { importGltf(all); });
  mayRefuse(path, [&] { importGltf(noCamera); });
}

}  // namespace mote::fuzz
