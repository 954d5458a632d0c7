// The readers of a glTF's parts, one .cpp a noun, and what they share. Internal to host/scene/gltf.
#pragma once
#include <map>
#include <set>
#include <string>

#include "host/scene/gltf/gltf_animation.h"
#include "host/scene/gltf/gltf_file.h"
#include "host/scene/gltf/gltf_import.h"
#include "host/scene/gltf/gltf_nodes.h"

namespace mote {

/// A glTF that is being read.
struct GltfShot {
  const ImportOptions& options;
  const GltfFile& file;
  const GltfNodes& nodes;
  GltfAnimations& animations;
  GltfValue value(std::size_t node) const { return nodes.value(file, node); }
};

/// Each reads its part of the scene's nodes into `shot`.
void importCamera(const GltfShot& gltf, ImportedShot& shot);
void importLights(const GltfShot& gltf, ImportedShot& shot);
void importSolids(const GltfShot& gltf, ImportedShot& shot);

/// The name by which a user knows a node: older Blenders put a camera or light into a node "NAME_Orientation" below.
std::string userName(const GltfNode& node);

/// Makes names of a scene out of names of a file, each once.
class SceneNames {
 public:
  /// `fallback`: an identifier for what has no name.
  std::string take(const std::string& name, const std::string& fallback);

 private:
  std::set<std::string> taken_;
  std::map<std::string, std::size_t> last_;  // the last number appended to a name
};

/// Where a node is and where it points: −Z and Y of its frame, unit length, at right angles.
struct GltfFrame {
  dvec3 position, forward, up;
};
/// Throws InputError at `value` where the transform squeezes these to nothing or is beyond what a scene may hold;
/// `when` says at what time.
GltfFrame frameOf(const dmat4& world, const GltfValue& value, const std::string& when);

}  // namespace mote
