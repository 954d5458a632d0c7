// Places of outputs, before any work.
#pragma once
#include <string>

namespace mote {

/// Tries whether the file can be written, and removes what killed runs left of it. Throws as OutputFile does.
void prepareOutput(const std::string& path);
/// The same for a pattern (frame_path.h): tries frame `first`, and removes what is left of any frame.
void prepareOutputs(const std::string& pattern, int first);

}  // namespace mote
