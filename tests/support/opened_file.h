// A particle file of given bytes, opened by its content, for tests of readers.
#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/particle_file.h"
#include "tests/support/refusal.h"
#include "tests/support/temp_folder.h"

namespace mote::test {

struct OpenedFile {
  TempFolder folder;
  std::unique_ptr<ParticleFile> file;

  /// `sampling`: of a volume, what is drawn from it.
  explicit OpenedFile(const std::string& bytes, const VolumeSampling& sampling = {}) {
    writeBytes(folder.file("particles"), bytes);
    file = openParticleFile(folder.file("particles"), sampling);
  }
  template <class T>
  std::vector<T> read(const std::string& channel) const {
    std::vector<T> values;
    const ChannelRequest request{channel, &values};
    file->read({&request, 1});
    return values;
  }
  /// All of it, raw.
  void readAll() const {
    for (const Channel& channel : file->channels()) read<std::byte>(channel.name);
  }
};

/// Opening or reading it must throw an InputError whose message has these words.
inline void expectFileRefused(const std::string& bytes, const std::vector<std::string>& words,
                              const VolumeSampling& sampling = {}) {
  expectRefused([&] { OpenedFile(bytes, sampling).readAll(); }, words);
}

/// Opens and reads the file with each of its bits flipped. It must be refused, as it is at least once, or read, with no
/// more than `mostParticles`. `step`: 9 takes another bit of each byte, but for every ninth: of formats that take long.
inline void expectEveryFlippedBitSurvived(const std::string& whole, std::uint64_t mostParticles, std::size_t step = 1) {
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  std::size_t refused = 0;
  for (std::size_t bit = 0; bit < 8 * whole.size(); bit += step) {
    std::string bytes = whole;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
    try {
      const OpenedFile opened(bytes);
      EXPECT_LE(opened.file->count(), mostParticles) << "bit " << bit;
      opened.readAll();
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0u);
}

/// Numbers as bytes, one after another.
template <class T>
std::string rawNumbers(std::initializer_list<T> values, bool bigEndian = false) {
  std::string bytes;
  for (const T value : values) {
    std::string one(sizeof(T), '\0');
    std::memcpy(one.data(), &value, sizeof(T));
    bytes += bigEndian ? std::string(one.rbegin(), one.rend()) : one;
  }
  return bytes;
}

}  // namespace mote::test
