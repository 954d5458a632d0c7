#include "engine/frame_files.h"

#include <algorithm>

#include "engine/splats.h"
#include "host/core/log.h"
#include "host/core/parallel.h"
#include "host/core/progress.h"
#include "host/core/sha256.h"
#include "host/core/timer.h"
#include "host/particles/particle_loader.h"
#include "host/scene/frame_path.h"
#include "host/scene/sequence.h"

namespace mote {
namespace {

std::vector<FrameInput> hashInputs(const std::vector<std::string>& files) {
  std::vector<FrameInput> inputs;
  for (auto file = files.begin(); file != files.end(); ++file)
    if (std::find(files.begin(), file, *file) == file) inputs.push_back({*file, sha256OfFile(*file)});
  return inputs;
}

}  // namespace

FrameFiles loadFrame(const Scene& scene, int number, FramePurpose purpose) {
  FrameFiles files;
  const WarningsKept keep(files.warnings);
  const Timer timer;
  files.number = number;
  std::vector<std::string> paths;
  files.particles = loadParticles(scene.particles, number, LoadRules(scene), &paths);
  paths.insert(paths.end(), scene.imported.begin(), scene.imported.end());
  std::vector<Solid> placed = scene.solids;
  std::vector<int> frames;
  for (Solid& solid : placed) {
    solid.translate -= files.particles.origin;
    frames.push_back(fileFrame(solid.file, number, scene.inputs.missing));
    if (std::string path = framePath(solid.file, frames.back()); paths.empty() || paths.back() != path)
      paths.push_back(std::move(path));
  }
  files.meshes = loadMeshes(placed, frames);
  if (purpose == FramePurpose::Picture) files.sprites = readSprites(scene, paths);
  files.inputs = hashInputs(paths);
  files.seconds = timer.seconds();
  return files;
}

FrameFiles FrameLoader::take(int number) {
  const Progress progress("load");
  if (!next_.valid() || number_ != number) return loadFrame(scene_, number, purpose_);
  return next_.get();
}

void FrameLoader::prefetch(int number) {
  if (threadCount() < 2) return;
  number_ = number;
  next_ = std::async(std::launch::async, [this, number] { return loadFrame(scene_, number, purpose_); });
}

}  // namespace mote
