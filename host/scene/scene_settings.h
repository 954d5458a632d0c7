// Everything in a scene that a picture may depend on, as one text: equal texts, equal pictures of equal input files.
#pragma once
#include <string>

#include "host/scene/json_tree.h"

namespace mote {

/// The document with its overrides, keys sorted, numbers in their shortest form; without the range of frames
/// (/frames/first, last, step) and without the picture's name (/output/file).
std::string sceneSettings(const JsonNode& root);

}  // namespace mote
