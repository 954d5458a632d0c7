// A scene.
#include "host/scene/scene_reader.h"

#include "tests/fuzz/fuzz.h"

namespace mote::fuzz {

void lookAt(const std::string& path, std::span<const std::byte>) {
  mayRefuse(path, [&] { readScene(path); });
}

}  // namespace mote::fuzz
