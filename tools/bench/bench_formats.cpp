// mote bench formats: a million particles of a noise cloud (position, radius, density, ID: 24 bytes) written to a file
// and read back, in every format that Mote writes, against the same numbers without any format; and files that are
// named, of every format that it reads. All rates are bytes of numbers, whatever the file's size.
//
// Files come from the system's cache of what has just been written: this is the formats' cost, not the disk's.
#include <algorithm>
#include <deque>

#include "host/core/random.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/output_stream.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/particle_writer.h"
#include "host/particles/generate.h"
#include "tools/bench/bench.h"
#include "tools/bench/scratch_file.h"

namespace mote {
namespace {

using Numbers = std::vector<std::vector<std::byte>>;  ///< of each channel

struct Written {
  const char* name;
  OutputFormat format;
  WriteOptions options = {};
};
const Written kWritten[] = {
    {"PRT 1.1", OutputFormat::Prt1},
    {"PRT 2, transpose-zlib", OutputFormat::Prt2, {.compression = "transpose-zlib"}},
    {"PRT 2, transpose-lz4", OutputFormat::Prt2, {.compression = "transpose-lz4"}},
    {"PLY", OutputFormat::Ply},
    {"PLY, text", OutputFormat::Ply, {.text = true}},
    {"CSV", OutputFormat::Csv},
    {"NPY", OutputFormat::Npy},
};

template <class T>
std::vector<std::byte> bytesOf(const std::vector<T>& numbers) {
  const std::span<const std::byte> bytes = std::as_bytes(std::span(numbers));
  return {bytes.begin(), bytes.end()};
}

std::uint64_t bytesOf(const Numbers& numbers) {
  std::uint64_t bytes = 0;
  for (const std::vector<std::byte>& channel : numbers) bytes += channel.size();
  return bytes;
}

void writeRaw(const std::string& path, const Numbers& numbers) {
  OutputStream file(path);
  for (const std::vector<std::byte>& channel : numbers) file.write(channel);
  file.commit();
}

Numbers readRaw(const std::string& path, const Numbers& sizes) {
  const InputFile file(path);
  Numbers numbers;
  for (const std::vector<std::byte>& channel : sizes) {
    numbers.emplace_back(channel.size());
    numbers.back().resize(file.read(numbers.back().data(), channel.size()));
  }
  return numbers;
}

Numbers readChannels(const std::string& path) {
  const std::unique_ptr<ParticleFile> file = openParticleFile(path);
  Numbers numbers(file->channels().size());
  std::vector<ChannelRequest> requests;
  for (std::size_t k = 0; k < numbers.size(); ++k) requests.push_back({file->channels()[k].name, &numbers[k]});
  file->read(requests);
  return numbers;
}

void writeChannels(const std::string& path, const Written& how, const std::vector<Channel>& channels,
                   const Numbers& numbers) {
  const std::unique_ptr<ParticleWriter> writer = createParticleFile(how.format, path, channels, {}, how.options);
  writer->write(std::vector<std::span<const std::byte>>(numbers.begin(), numbers.end()));
  writer->finish();
}

BenchCheck sameNumbers(const Numbers& found, const Numbers& expected) {
  if (found != expected) return {"numbers differ", false};
  return {"the same numbers, bit for bit", true};
}

std::string megabytes(std::uint64_t bytes) { return fmt::format("{:.1f} MB", static_cast<double>(bytes) * 1e-6); }

/// A file, and its numbers without a format beside it.
struct Read {
  std::string path;
  ScratchFile raw;
  Numbers expected, bare, found;

  Read(std::string file, Numbers numbers)
      : path(std::move(file)), raw("mote_bench_formats.raw"), expected(std::move(numbers)) {
    writeRaw(raw.path(), expected);
  }
  Trial trial(const std::string& name) {
    const std::uint64_t bytes = bytesOf(expected);
    return {.name = fmt::format("read {} ({})", name, megabytes(InputFile(path).bytes())),
            .unit = "bytes of numbers",
            .a = {.name = "bare numbers", .work = [this] { bare = readRaw(raw.path(), expected); }, .count = bytes},
            .b = Contender{.name = name, .work = [this] { found = readChannels(path); }, .count = bytes},
            .check = [this] { return both(sameNumbers(bare, expected), sameNumbers(found, expected)); }};
  }
};

}  // namespace

void benchFormats(Bench& bench) {
  for (const std::string& path : bench.files())
    openParticleFile(path);  // what is wrong with it is said before any work
  const ParticleSet cloud = generateParticles(Generator::Cloud, bench.count(), 0, 1);
  std::vector<std::uint32_t> ids(cloud.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::uint32_t>(hashBits(0, i, 0));
  const std::vector<Channel> channels{{"Position", NumberType::F32, 3},
                                      {"Radius", NumberType::F32, 1},
                                      {"Density", NumberType::F32, 1},
                                      {"ID", NumberType::U32, 1}};
  const Numbers numbers{bytesOf(cloud.position), bytesOf(cloud.radius), bytesOf(cloud.density), bytesOf(ids)};

  std::deque<ScratchFile> files;  // neither moves
  std::deque<Read> reads;
  std::vector<Trial> trials;
  const std::string raw = files.emplace_back("mote_bench_formats.raw").path();
  for (const Written& how : kWritten) {
    const std::string path = files.emplace_back("mote_bench_formats").path();
    trials.push_back({.name = fmt::format("write {}", how.name),
                      .unit = "bytes of numbers",
                      .a = {.name = "bare numbers", .work = [&] { writeRaw(raw, numbers); }, .count = bytesOf(numbers)},
                      .b = Contender{.name = how.name,
                                     .work = [&, path] { writeChannels(path, how, channels, numbers); },
                                     .count = bytesOf(numbers)},
                      .check = [&, path] { return sameNumbers(readChannels(path), numbers); }});
  }
  bench.compareInTurn(trials);

  trials.clear();
  for (std::size_t k = 0; k < std::size(kWritten); ++k)
    trials.push_back(reads.emplace_back(files[k + 1].path(), numbers).trial(kWritten[k].name));
  for (const std::string& path : bench.files())
    trials.push_back(
        reads.emplace_back(path, readChannels(path)).trial(openParticleFile(path)->format() + ", " + path));
  bench.compareInTurn(trials);
}

}  // namespace mote
