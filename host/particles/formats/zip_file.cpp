#include "host/particles/formats/zip_file.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>

#include "host/core/error.h"
#include "host/particles/formats/input_file.h"

namespace mote {
namespace {

zip_t* archiveOf(void* archive) { return static_cast<zip_t*>(archive); }
zip_file_t* streamOf(void* stream) { return static_cast<zip_file_t*>(stream); }

zip_t* opened(const std::string& path) {
  int code = 0;
  if (zip_t* archive = zip_open(path.c_str(), ZIP_RDONLY, &code)) return archive;
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  const std::string message = zip_error_strerror(&error);
  zip_error_fini(&error);
  if (code == ZIP_ER_MEMORY) throw MachineError(fmt::format("{}: not enough memory for its directory", path));
  throw InputError(path, "zip directory", "one at the file's end", fmt::format("'{}'", message),
                   "the file is cut off or damaged: copy it again, or save it again");
}

ZipMember memberAt(const std::string& path, zip_t* archive, std::uint64_t index, std::uint64_t fileBytes) {
  zip_stat_t facts;
  zip_stat_init(&facts);
  constexpr zip_uint64_t kNeeded =
      ZIP_STAT_NAME | ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
  if (zip_stat_index(archive, index, 0, &facts) != 0 || (facts.valid & kNeeded) != kNeeded)
    throw InputError(path, fmt::format("zip member {}", index), "a directory entry", "a damaged one");
  const std::string what = fmt::format("zip member '{}'", facts.name);
  if (facts.encryption_method != ZIP_EM_NONE)
    throw InputError(path, what, "no encryption", "an encrypted member",
                     "unzip it and zip it again without a password");
  const bool stored = facts.comp_method == ZIP_CM_STORE;
  if (!stored && facts.comp_method != ZIP_CM_DEFLATE)
    throw InputError(path, what, "a member that is stored or deflated, as NumPy writes them",
                     fmt::format("method {}", facts.comp_method));
  if (facts.comp_size > fileBytes || (stored && facts.size != facts.comp_size) ||
      facts.size / kDeflateExpansion > facts.comp_size)
    throw InputError(path, what, fmt::format("what {} bytes can be unpacked to", std::min(facts.comp_size, fileBytes)),
                     fmt::format("{} bytes", facts.size), "the file is cut off or damaged");
  return {facts.name, index, facts.size, facts.comp_size};
}

}  // namespace

void ZipFile::Close::operator()(void* archive) const { zip_discard(archiveOf(archive)); }

ZipFile::ZipFile(std::string path) : path_(std::move(path)), bytes_(InputFile(path_).bytes()) {
  archive_.reset(opened(path_));
  const zip_int64_t count = zip_get_num_entries(archiveOf(archive_.get()), 0);
  std::uint64_t packed = 0;
  for (zip_int64_t k = 0; k < count; ++k) {
    members_.push_back(memberAt(path_, archiveOf(archive_.get()), static_cast<std::uint64_t>(k), bytes_));
    packed += members_.back().packedBytes;  // each is at most the file's
    if (packed > bytes_)
      throw InputError(path_, "zip directory", fmt::format("members of {} bytes together at most", bytes_), "more",
                       "members that share their bytes are no particles");
  }
}

void ZipStream::Close::operator()(void* stream) const { zip_fclose(streamOf(stream)); }

ZipStream::ZipStream(const ZipFile& file, const ZipMember& member) : file_(file), member_(member) {
  zip_t* archive = archiveOf(file.archive_.get());
  stream_.reset(zip_fopen_index(archive, member.index, 0));
  if (stream_) return;
  throw InputError(file.path(), fmt::format("zip member '{}'", member.name), "valid data",
                   fmt::format("'{}'", zip_strerror(archive)), "the file is damaged");
}

std::size_t ZipStream::read(std::byte* to, std::size_t wanted) {
  std::size_t done = 0;
  while (done < wanted) {
    const zip_int64_t got = zip_fread(streamOf(stream_.get()), to + done, wanted - done);
    if (got < 0)
      throw InputError(file_.path(), fmt::format("zip member '{}'", member_.name), "valid data",
                       fmt::format("'{}' at byte {}", zip_file_strerror(streamOf(stream_.get())), at_),
                       "the file is damaged");
    if (got == 0) break;
    done += static_cast<std::size_t>(got), at_ += static_cast<std::uint64_t>(got);
  }
  return done;
}

void ZipStream::readAll(std::byte* to, std::size_t bytes, const char* what) {
  const std::uint64_t from = at_;
  const std::size_t got = read(to, bytes);
  if (got != bytes)
    throw InputError(file_.path(), fmt::format("zip member '{}', {}", member_.name, what),
                     fmt::format("{} bytes at byte {}", bytes, from), fmt::format("only {}", got),
                     "the file is cut off or its header is damaged");
}

void ZipStream::expectEnd() {
  std::byte more{};
  if (read(&more, 1) != 0)
    throw InputError(file_.path(), fmt::format("zip member '{}'", member_.name), fmt::format("{} bytes", at_ - 1),
                     "more", "the file is damaged");
}

}  // namespace mote
