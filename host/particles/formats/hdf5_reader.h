// Reads HDF5: snapshots as GADGET-4, AREPO and SWIFT write them (groups PartType0 …, of which PartType0 is gas), also
// in several files, and plain files with arrays in the root.
//
// Every array of a particle is a channel under its own name, but for the gas' `Density`, which is `MassDensity` where
// there are masses: it is mass per volume, whereas Mote's Density goes with the mass. Made here where they are not
// there:
//   Masses   of the Header's MassTable, the same for all
//   Radius   from SWIFT's smoothing lengths, which are shorter than the support by HydroScheme's "Kernel gamma"
//            (GADGET's and AREPO's are the support: GADGET-2 paper, eq. 4); without any of gas,
//            1.5 × (mass / mass density)^(1/3), which is what "auto" takes where particles fill their volume evenly.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/particles/formats/hdf5_file.h"
#include "host/particles/formats/particle_file.h"

namespace mote {

/// Also where libhdf5 is not in this build: the constructor then says so.
bool beginsAsHdf5(std::span<const std::byte> start);

class Hdf5Reader : public ParticleFile {
 public:
  /// Throws InputError on what is no HDF5, is damaged, or holds no particles; where a snapshot's other files are
  /// missing (naming them); and where it has no gas, but several other types of particles (naming them and their
  /// numbers). The attributes of Header, Units and Cosmology, and the units of Parameters, are metadata.
  explicit Hdf5Reader(std::string path);

  /// Cost: that of reading the arrays asked for; some 400 MB/s, deflated ones some 160.
  void read(std::span<const ChannelRequest> requests) const override;

 private:
  /// Where a channel's numbers come from.
  struct Source {
    enum class Kind { Array, Constant, Volume } kind = Kind::Array;
    std::string array;    ///< its name in the file
    double constant = 0;  ///< Constant: the number; Volume: the mass of each, 0: array `Masses` has them
  };
  struct Part {
    std::string path;
    std::vector<Hdf5Array> arrays;
  };
  void openSnapshot(const Hdf5File& first);
  void openPlain(const Hdf5File& file);
  std::vector<std::string> partPaths() const;
  void chooseGroup(std::span<const std::vector<Hdf5Group>> files);
  void addArrays(const std::string& counted);
  void addMasses();
  void addRadius();
  void addChannel(Channel channel, Source source);
  double metaNumber(std::string_view name, std::size_t index) const;
  void readArray(const std::string& name, class ChannelSink& sink) const;
  std::vector<double> numbers(const std::string& array) const;

  std::string group_;  ///< "PartType0"; empty: arrays of the root
  std::vector<Part> parts_;
  std::vector<Source> sources_;  ///< one a channel
};

}  // namespace mote
