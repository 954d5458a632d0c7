// A zip archive and what is packed in it, for readers: stored and deflated members, zip64 and data descriptors too.
// libzip reads the directory and checks every member's checksum.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mote {

struct ZipMember {
  std::string name;
  std::uint64_t index = 0;        ///< in the archive's directory
  std::uint64_t bytes = 0;        ///< unpacked, as the directory has it; deflate could make so many of its packed ones
  std::uint64_t packedBytes = 0;  ///< as it stands in the file
};

class ZipFile {
 public:
  /// Reads the directory. Throws InputError where there is none, and where a member is encrypted, packed with anything
  /// but deflate, said to be larger than deflate can make it, or where the members together are larger than the file.
  explicit ZipFile(std::string path);

  const std::string& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }  ///< of the file as it is
  const std::vector<ZipMember>& members() const { return members_; }

 private:
  friend class ZipStream;
  struct Close {
    void operator()(void* archive) const;
  };
  std::string path_;
  std::uint64_t bytes_ = 0;
  std::unique_ptr<void, Close> archive_;  // libzip's
  std::vector<ZipMember> members_;
};

/// A member from its first byte to its last. Several may be open at once; `file` must outlive them.
class ZipStream {
 public:
  ZipStream(const ZipFile& file, const ZipMember& member);

  /// As many as there are: fewer than `wanted` only at the end. Throws InputError where the packed data are damaged.
  std::size_t read(std::byte* to, std::size_t wanted);
  /// Exactly so many, or InputError, which says `what` was to be read.
  void readAll(std::byte* to, std::size_t bytes, const char* what);
  /// To be called behind the last byte: throws InputError where more follow, or where the checksum is another.
  void expectEnd();

 private:
  struct Close {
    void operator()(void* stream) const;
  };
  const ZipFile& file_;
  const ZipMember& member_;
  std::unique_ptr<void, Close> stream_;  // libzip's
  std::uint64_t at_ = 0;
};

}  // namespace mote
