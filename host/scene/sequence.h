// Files of which there is one a frame: which exist, which are missing, which is held in their place.
#pragma once
#include <string>
#include <vector>

#include "host/scene/scene.h"

namespace mote {

/// Frames of which a file of this name exists, ascending. Empty where the name has no place for a frame number.
/// Reads the folder once.
std::vector<int> existingFrames(const std::string& pattern);

/// The frame whose file stands for `frame`: itself where its file exists or gaps are errors; else, with
/// MissingFrames::Hold, the nearest earlier one, with a warning. Itself too where there is no earlier one: to open its
/// file will fail.
int fileFrame(const std::string& pattern, int frame, MissingFrames missing);

/// Throws InputError, before any work, where a source or a solid has no file for a frame of the scene; it names the
/// frames that are missing, as --frames takes them. With MissingFrames::Hold only for those before the first file.
void checkSequences(const Scene& scene);

}  // namespace mote
