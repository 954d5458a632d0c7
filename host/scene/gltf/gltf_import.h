// A shot from a glTF 2.0 file, as Blender exports it: camera with its motion, punctual lights and meshes.
//
// Sources: glTF 2.0 Specification, §3.10 "Cameras"; KHR_lights_punctual (Khronos, ratified extension).
//
// Both worlds have y up in a right-handed frame, and 1 unit of the file is 1 scene unit. Cameras and lights look along
// −Z of their node; its world transform places and turns them, and its scale changes none of their properties.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/scene/scene.h"

namespace mote {

/// Photometric to radiometric: lumens of a watt of light at 555 nm, which Blender's "Standard" export multiplies by.
constexpr double kLumensPerWatt = 683;

struct ImportOptions {
  std::string file;  ///< path as opened
  bool camera = true, lights = true, solids = true;
  std::string cameraName;                 ///< of the node or of the camera itself; "": the scene's first
  double lumensPerWatt = kLumensPerWatt;  ///< 1: the file's intensities are W/sr and W/m² already
  double frame = 0;                       ///< at which the file's time 0 is
  double fps = 24;
};

struct ImportedShot {
  std::optional<Camera> camera;  ///< placed; keys where it moves
  std::vector<LightSource> lights;
  std::vector<Solid> solids;       ///< a node with a mesh each
  std::vector<std::string> files;  ///< that this was read from or refers to, the glTF first
};

/// Reads what the options ask for. Names become names of a scene: what is no letter, digit or _ becomes _, 17
/// characters at most, and a number is appended where a name has been taken.
///
/// Camera: fov is yfov, height is 2 · ymag, whatever the aspect; near and far are the file's. The target lies as far
/// ahead as the world's origin is away, at least 1. A camera that moves, itself or with a node above it, gets a key
/// at each whole frame of the motion and at its ends; a key's place is the exact one at its time.
/// Lights: candela and lux become W/sr and W/m² by lumensPerWatt; cone angles are half angles; decay 2. `range` is
/// no physics and is left out. Lights and solids stand as the file has them at rest.
/// Solids: albedo is the first material's base colour; meshes without triangles are left out. The triangles are read
/// later, by loadMesh.
/// What is left out is warned of. Throws InputError "shot.glb: /nodes/3/…: expected …, got …".
ImportedShot importGltf(const ImportOptions& options);

}  // namespace mote
