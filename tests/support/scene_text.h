// Scenes in text, and what reading them says.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "host/core/error.h"
#include "host/scene/scene_reader.h"
#include "tests/support/contains.h"

namespace mote::test {

using Overrides = std::vector<std::string>;

inline const std::string kLeast = R"({"particles":[{"file":"x.prt"}]})";

/// A scene of one particle file and these further keys of the root.
inline std::string with(const std::string& keys) { return R"({"particles":[{"file":"x.prt"}],)" + keys + "}"; }

/// The message of the InputError that parsing throws; "" if it throws none.
inline std::string errorOf(const std::string& text, const Overrides& overrides = {}) {
  try {
    parseScene(text, "s.json", overrides);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace mote::test
