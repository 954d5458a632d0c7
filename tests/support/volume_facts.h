// What tests ask of a volume's file and of the particles that were drawn from it.
#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "tests/support/opened_file.h"

namespace mote::test {

/// Of all particles.
inline double densitySum(const OpenedFile& opened) {
  double all = 0;
  for (const float d : opened.read<float>("Density")) all += static_cast<double>(d);
  return all;
}

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

}  // namespace mote::test
