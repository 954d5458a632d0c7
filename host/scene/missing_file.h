// What to tell a user whose file does not exist.
#pragma once
#include <string>

namespace mote {

/// A sentence part about what lies in the folder of `path`: which frames of `pattern` exist, else the most similar
/// names, else that the folder itself is missing. Never throws for what it finds on the disk.
std::string nearestNames(const std::string& pattern, const std::string& path);

}  // namespace mote
