// "solids": meshes that stand in the medium.
#include <fmt/format.h>

#include <map>
#include <string_view>
#include <vector>

#include "host/scene/scene_parts.h"

namespace mote {
namespace {

/// Without a file the name must be that of a solid of the import.
void refuseUnknown(ObjectReader& object, const std::string& name, const std::vector<Solid>& solids) {
  if (!object.has("name") || solids.empty()) return object.problem("", R"("file", the mesh)", "none");
  std::vector<std::string_view> names;
  for (const Solid& solid : solids) names.push_back(solid.name);
  object.problem("name", "the name of a solid of the import, as there is no file", quotedForMessage(name),
                 fmt::format("the nearest is \"{}\"", nearestWord(name, names)));
}

/// `solid`: of that name already, or one of defaults; it is what absent keys leave. A file takes the place of a node.
void readSolid(ObjectReader& object, Solid& solid, const std::filesystem::path& folder) {
  solid.pointer = object.pointer();
  if (readPath(object, "file", solid.file, folder)) solid.node.reset();
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
}

}  // namespace

void readSolids(ObjectReader& root, Scene& scene) {
  const std::filesystem::path folder = folderOf(scene);
  std::vector<ObjectReader> objects = root.list("solids", "a solid");
  std::map<std::string, std::string> given;  // pointers by name
  for (std::size_t i = 0; i < objects.size(); ++i) {
    std::string name = fmt::format("solid{}", i);
    readName(objects[i], name);
    const auto known = findNamed(scene.solids, name);
    const auto [before, isNew] = given.try_emplace(name, objects[i].pointer());
    const bool changes = known != scene.solids.end() && isNew && objects[i].has("name");
    if (known != scene.solids.end() && !changes)
      objects[i].problem("name", "a name that no other solid has", quotedForMessage(name),
                         fmt::format("{} has it", known->pointer));
    if (!changes && !objects[i].has("file")) refuseUnknown(objects[i], name, scene.solids);
    Solid solid = changes ? *known : Solid{};
    solid.name = name;
    readSolid(objects[i], solid, folder);
    if (changes)
      *known = std::move(solid);
    else
      scene.solids.push_back(std::move(solid));
  }
}

}  // namespace mote
