// Reads PLY files (Turk 1994, "The PLY Polygon File Format"), text and binary of both byte orders: the properties of
// the element `vertex`, or of `point` or `particle`. Scalars that are a vector by their names become one channel
// (component_names.h).
//
// A file of 3D Gaussian splats (Kerbl et al. 2023: scale_0 … 2, opacity, f_dc_0 … 2) also has
//   Radius   of the kernel (1 − q)² whose variance across a ray is that of the Gaussian's mean size: √8 · ∛(e^s0 e^s1
//   e^s2) Density  the cross-section whose peak has the splat's opacity α = 1 / (1 + e^−o): −ln(1 − α) · π r² / 3 Color
//   of the first harmonic, ½ + f_dc / (2√π), at least 0
// A splat is an ellipsoid there and a ball here.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/component_names.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"

namespace mote {

bool beginsAsPly(std::span<const std::byte> start);

class PlyReader : public ParticleFile {
 public:
  /// Throws InputError on any breach of the format in front of the particles, and where they have lists.
  explicit PlyReader(std::string path);

  /// Cost: that of reading a binary file; text some 30 MB/s.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  enum class Encoding { Text, LittleEndian, BigEndian };
  struct Property;
  struct Element;

  std::vector<Element> parseHeader();
  void skipElement(const Element& element);
  void addSplatChannels();
  void readStored(std::span<const ChannelRequest> requests) const;
  void readBinary(std::vector<class ChannelSink>& sinks) const;
  void readText(std::vector<class ChannelSink>& sinks) const;

  InputFile file_;
  Encoding encoding_ = Encoding::Text;
  std::vector<PlacedChannel> columns_;  ///< each property by itself
  std::vector<PlacedChannel> placed_;   ///< those that are stored
  std::size_t rowBytes_ = 0;
  std::uint64_t dataBegin_ = 0;
};

}  // namespace mote
