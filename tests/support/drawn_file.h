// As OpenedFile, of a file with a say in what is drawn from it.
#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "host/core/error.h"
#include "host/particles/formats/particle_file.h"
#include "tests/support/temp_folder.h"

namespace mote::test {

struct DrawnFile {
  TempFolder folder;
  std::unique_ptr<ParticleFile> file;

  explicit DrawnFile(const std::string& bytes, const VolumeSampling& sampling = {}) {
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
  double sum() const {
    double all = 0;
    for (const float d : read<float>("Density")) all += static_cast<double>(d);
    return all;
  }
};

/// A number of a file's metadata, float64 or uint64.
inline double metadataNumber(const ParticleFile& file, const std::string& name) {
  const Metadata* metadata = file.meta("", name);
  if (!metadata || metadata->bytes.size() != sizeof(double)) {
    ADD_FAILURE() << "no number '" << name << "'";
    return 0;
  }
  double value = 0;
  std::uint64_t whole = 0;
  std::memcpy(&value, metadata->bytes.data(), sizeof value);
  std::memcpy(&whole, metadata->bytes.data(), sizeof whole);
  return metadata->type == static_cast<std::int32_t>(NumberType::U64) ? static_cast<double>(whole) : value;
}

/// Opening or reading it must throw an InputError whose message has these words.
inline void expectDrawnRefused(const std::string& bytes, const VolumeSampling& sampling,
                               const std::vector<std::string>& words) {
  try {
    DrawnFile(bytes, sampling).readAll();
    ADD_FAILURE() << "nothing was thrown; expected '" << (words.empty() ? "" : words[0]) << "'";
  } catch (const InputError& error) {
    for (const std::string& word : words)
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << word << " is not in: " << error.what();
  }
}

}  // namespace mote::test
