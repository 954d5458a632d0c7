// From a scene file to a Scene: parsed, checked whole and with every default filled in, before any work starts.
#pragma once
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/scene/scene.h"

namespace mote {

/// Reads the scene at `path`. `overrides` are the arguments of `--set`, "/json/pointer=VALUE", applied in order as if
/// they were written in the file. Throws InputError "path:line:column: /json/pointer: expected …, got … (hint)".
Scene readScene(const std::string& path, std::span<const std::string> overrides = {});

/// The same for text in memory; `path` is what messages say and what relative paths are relative to.
Scene parseScene(std::string_view text, const std::string& path, std::span<const std::string> overrides = {});

/// Every key the parser reads, by object, with * for array indices: {"/lights/*": {"name", "type", …}, …}. It is what
/// ../../scenes/scene.schema.json must describe.
std::map<std::string, std::vector<std::string>> knownSceneKeys();

}  // namespace mote
