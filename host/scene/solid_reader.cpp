// "solids": meshes that stand in the medium.
#include <fmt/format.h>

#include <algorithm>

#include "host/scene/scene_parts.h"

namespace mote {
namespace {

Solid readSolid(ObjectReader& object, std::size_t index, const std::filesystem::path& folder) {
  Solid solid;
  solid.pointer = object.pointer();
  solid.name = fmt::format("solid{}", index);
  readName(object, solid.name);
  if (!object.has("file")) object.problem("", R"("file", the mesh)", "none");
  readPath(object, "file", solid.file, folder);
  object.choice<SolidMode>(
      "mode", solid.mode,
      {{"shaded", SolidMode::Shaded}, {"holdout", SolidMode::Holdout}, {"hidden", SolidMode::Hidden}});
  object.vector("albedo", solid.albedo, kShare);
  object.boolean("casts_shadows", solid.castsShadows);
  object.boolean("receives_shadows", solid.receivesShadows);
  object.vector("translate", solid.translate, kCoordinate);
  object.vector("rotate", solid.rotate, kDegrees);
  object.number("scale", solid.scale, above(0));
  object.finish();
  return solid;
}

}  // namespace

void readSolids(ObjectReader& root, Scene& scene) {
  const std::filesystem::path folder = folderOf(scene);
  std::vector<ObjectReader> objects = root.list("solids", "a solid");
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Solid solid = readSolid(objects[i], i, folder);
    const auto earlier = std::find_if(scene.solids.begin(), scene.solids.end(),
                                      [&](const Solid& other) { return other.name == solid.name; });
    if (earlier != scene.solids.end())
      objects[i].problem("name", "a name that no other solid has", quotedForMessage(solid.name),
                         fmt::format("{} has it", earlier->pointer));
    scene.solids.push_back(std::move(solid));
  }
}

}  // namespace mote
