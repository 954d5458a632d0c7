// A file that is read, for readers of particles.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace mote {

class InputFile {
 public:
  /// Throws InputError where there is none, or where it is no regular file that may be read.
  explicit InputFile(std::string path);

  const std::string& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }
  std::FILE* handle() const { return file_.get(); }

  /// Throws MachineError where the machine refuses.
  void seek(std::uint64_t position) const;
  /// As many as there are, from where the file is: fewer than `wanted` only at its end.
  std::size_t read(std::byte* to, std::size_t wanted) const;
  /// The file's first bytes, at most so many; the position is the beginning again.
  std::vector<std::byte> start(std::size_t most) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t bytes_ = 0;
};

}  // namespace mote
