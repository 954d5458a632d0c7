// A file that a benchmark writes and reads.
#pragma once
#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "host/core/error.h"
#include "host/core/output_file.h"

namespace mote {

/// Among the system's temporary files, and gone after this, or after a signal: an OutputFile never committed.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& name) : file_(folder() + "/" + name) {}
  const std::string& path() const { return file_.temporaryPath(); }

 private:
  static std::string folder() {
    std::error_code error;
    const std::filesystem::path found = std::filesystem::temp_directory_path(error);
    if (error) throw MachineError(fmt::format("there is no folder for temporary files (TMPDIR): {}", error.message()));
    return found.string();
  }

  OutputFile file_;
};

}  // namespace mote
