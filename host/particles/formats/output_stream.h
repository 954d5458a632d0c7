// A file that is being written, whole or not at all, for writers of particles.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "host/core/output_file.h"

namespace mote {

/// Bytes go into an OutputFile's temporary; without commit() nothing is left behind. Every call throws MachineError,
/// with the number of bytes, where the disk refuses.
class OutputStream {
 public:
  /// Throws InputError as OutputFile does.
  explicit OutputStream(const std::string& path);

  const std::string& path() const { return file_.path(); }
  std::uint64_t written() const { return written_; }

  /// Behind what is there.
  void write(std::string_view bytes);
  void write(std::span<const std::byte> bytes) {
    write(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }
  /// Over what is there, from `at` on: counts that are known only at the end.
  void replace(std::uint64_t at, std::string_view bytes);
  /// Call once; nothing may follow.
  void commit();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  [[noreturn]] void refuse() const;

  OutputFile file_;
  std::unique_ptr<std::FILE, Close> stream_;
  std::uint64_t written_ = 0;
};

}  // namespace mote
