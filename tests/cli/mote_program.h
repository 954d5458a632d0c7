// The built program as the CLI tests run it.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/contains.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

namespace mote::test {

/// A driver file that does not exist: a machine without Vulkan.
inline const ProcessOptions kWithoutVulkan{
    .environment = {{"VK_ICD_FILENAMES", "/nonexistent"}, {"VK_DRIVER_FILES", "/nonexistent"}}};
inline const ProcessOptions kOnLavapipe{
    .environment = {{"VK_ICD_FILENAMES", "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json"},
                    {"VK_DRIVER_FILES", "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json"}}};

/// Runs `mote` with these arguments.
inline ProcessResult mote(std::vector<std::string> arguments, const ProcessOptions& options = {}) {
  arguments.insert(arguments.begin(), MOTE_BINARY);
  return runProcess(std::move(arguments), options);
}

/// A ball of 2000 particles, made by the program itself.
inline std::string makeBall(const TempFolder& folder, const std::string& name = "ball.prt") {
  const ProcessResult made = mote({"generate", "ball", "--count", "2000", "-o", folder.file(name)});
  EXPECT_EQ(made.exitCode, 0) << made.err;
  return folder.file(name);
}

}  // namespace mote::test
