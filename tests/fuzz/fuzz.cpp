#include "tests/fuzz/fuzz.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/block_reader.h"

namespace mote::fuzz {
namespace {

/// A sentence with a list of channels or a quotation in it; an artist reads no more.
constexpr std::size_t kMostMessageBytes = 4096;

/// A file without a disk. Readers open it anew by its path, so that none sees where another one stopped.
class MemoryFile {
 public:
  MemoryFile() : file_(::memfd_create("fuzz", MFD_CLOEXEC)), path_(fmt::format("/proc/self/fd/{}", file_)) {
    if (file_ < 0) std::abort();
  }
  const std::string& path() const { return path_; }
  void hold(const std::uint8_t* bytes, std::size_t size) const {
    if (::ftruncate(file_, 0) != 0 || ::pwrite(file_, bytes, size, 0) != static_cast<ssize_t>(size)) std::abort();
  }

 private:
  int file_;
  std::string path_;
};

/// Names are unique, and what has particles has channels.
void checkNames(const ParticleFile& file) {
  std::set<std::string> channels;
  std::set<std::pair<std::string, std::string>> metadata;
  for (const Channel& channel : file.channels()) MOTE_CHECK(channels.insert(channel.name).second, ==, true);
  for (const Metadata& m : file.metadata()) MOTE_CHECK(metadata.emplace(m.channel, m.name).second, ==, true);
  MOTE_CHECK(file.count() > 0 && channels.empty(), ==, false);
}

}  // namespace

void mayRefuse(const std::string& path, const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    const std::string_view message = error.what();
    const bool named = message.find(path) != std::string_view::npos || message.starts_with('/');  // or one beside it
    MOTE_CHECK(named, ==, true);
    MOTE_CHECK(message.size(), <=, kMostMessageBytes);
  }
}

void readRaw(const ParticleFile& file) {
  checkNames(file);
  const std::vector<Channel>& channels = file.channels();
  std::vector<std::vector<std::byte>> numbers(channels.size());
  std::vector<ChannelRequest> requests;
  std::vector<std::string> names;
  for (std::size_t k = 0; k < channels.size(); ++k) {
    requests.push_back({channels[k].name, &numbers[k]});
    names.push_back(channels[k].name);
  }
  file.read(requests);
  for (std::size_t k = 0; k < channels.size(); ++k)
    MOTE_CHECK(numbers[k].size(), ==, file.count() * channels[k].bytes());
  if (channels.empty()) return;
  std::uint64_t inBlocks = 0;
  readBlocks(file, names, [&](auto, std::size_t count) { inBlocks += count; });
  MOTE_CHECK(inBlocks, ==, file.count());
}

}  // namespace mote::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace mote;
  // Coverage tells inputs apart only where the same input always goes the same way.
  static const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  static const fuzz::MemoryFile file;
  setVerbosity(Verbosity::Quiet);
  file.hold(bytes, size);
  fuzz::lookAt(file.path(), std::as_bytes(std::span(bytes, size)));
  takeWarnings();  // they would pile up
  return 0;
}
