// "view", "output" and "frames": how the picture is drawn, what it is written as, and of which frames.
#include <fmt/format.h>

#include "host/scene/frame_path.h"
#include "host/scene/scene_parts.h"

namespace mote {
namespace {

/// A picture's path as it is to be opened; "" is none.
void readSprite(ObjectReader& object, std::string_view key, std::string& path, const std::filesystem::path& folder) {
  const JsonNode* node = object.find(key);
  if (node && node->kind == JsonNode::Kind::String && node->text.empty()) return;
  std::string given;
  if (object.text(key, given)) path = (folder / given).string();
}

void readLayers(ObjectReader& object, Output& output) {
  constexpr std::string_view kLayers[] = {"Z", "shadow", "lights", "velocity", "optical_depth"};
  bool* const wanted[] = {&output.depth, &output.shadow, &output.lights, &output.velocity, &output.opticalDepth};
  std::vector<bool> named(std::size(kLayers));
  object.words("aovs", named, kLayers);
  for (std::size_t i = 0; i < named.size(); ++i) *wanted[i] = named[i];
}

}  // namespace

void readView(ObjectReader& root, const std::filesystem::path& folder, View& view) {
  ObjectReader object = root.object("view", "the view settings");
  readBackend(object, view.backend);
  object.number("radius_scale", view.radiusScale, above(0));
  readSprite(object, "sprite_color", view.spriteColor, folder);
  readSprite(object, "sprite_opacity", view.spriteOpacity, folder);
  object.finish();
}

void readOutput(ObjectReader& root, const std::filesystem::path& folder, Output& output) {
  output.file = (folder / output.file).string();
  ObjectReader object = root.object("output", "the output");
  readPath(object, "file", output.file, folder);
  object.pair("size", output.size, 1, 16384, "pixels");
  object.choice<Precision>("precision", output.precision, {{"half", Precision::Half}, {"float", Precision::Float}});
  object.choice<Compression>("compression", output.compression,
                             {{"none", Compression::None},
                              {"rle", Compression::Rle},
                              {"zips", Compression::Zips},
                              {"zip", Compression::Zip},
                              {"piz", Compression::Piz}});
  object.number("pixel_aspect", output.pixelAspect, between(0.01, 100));
  readLayers(object, output);
  object.finish();
}

void readFrames(ObjectReader& root, Scene& scene) {
  Frames& frames = scene.frames;
  ObjectReader object = root.object("frames", "the frame range");
  object.integer("first", frames.first, -kMaxFrame, kMaxFrame);
  frames.last = frames.first;
  object.integer("last", frames.last, -kMaxFrame, kMaxFrame);
  object.integer("step", frames.step, 1, kMaxFrame);
  object.number("fps", frames.fps, above(0, "frames per second"));
  if (frames.last < frames.first)
    object.problem("last", fmt::format("a last frame >= the first, {}", frames.first), std::to_string(frames.last));
  if (object.has("first") || object.has("last")) scene.shot = frames;
  object.finish();
}

}  // namespace mote
