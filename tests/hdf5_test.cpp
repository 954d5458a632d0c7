// HDF5: what the reader accepts and refuses. Files are made by libhdf5 itself, and damaged here byte by byte.
#include "host/particles/formats/hdf5_reader.h"

#include <gtest/gtest.h>

#include "host/particles/our_channels.h"
#include "host/particles/particle_loader.h"
#include "tests/support/opened_file.h"

#ifdef MOTE_HAS_HDF5
#include <hdf5.h>
#include <zlib.h>
#endif

namespace mote {
namespace {

using namespace test;

TEST(Hdf5Reader, IsRecognisedWhereverItsSignatureMayStand) {
  const std::string signature("\x89HDF\r\n\x1a\n", 8);
  const auto begins = [](const std::string& bytes) { return beginsAsHdf5(std::as_bytes(std::span(bytes))); };
  for (const std::size_t at : {0u, 512u, 1024u, 2048u, 4096u}) EXPECT_TRUE(begins(std::string(at, 'x') + signature));
  for (const std::size_t at : {1u, 511u, 1536u}) EXPECT_FALSE(begins(std::string(at, 'x') + signature));
  EXPECT_FALSE(begins(""));
  EXPECT_FALSE(begins(signature.substr(0, 7)));
}

#ifndef MOTE_HAS_HDF5

TEST(Hdf5Reader, SaysThatThisBuildLacksIt) {
  EXPECT_FALSE(hasHdf5());
  expectFileRefused(std::string("\x89HDF\r\n\x1a\n", 8), {"HDF5, which it was built without", "-DMOTE_HDF5=ON"});
}

#else

template <class T>
hid_t typeOf();
template <>
hid_t typeOf<float>() {
  return H5T_IEEE_F32LE;
}
template <>
hid_t typeOf<double>() {
  return H5T_IEEE_F64LE;
}
template <>
hid_t typeOf<std::uint64_t>() {
  return H5T_STD_U64LE;
}
template <>
hid_t typeOf<std::int32_t>() {
  return H5T_STD_I32LE;
}

/// How an array lies in the file.
struct Storage {
  std::vector<hsize_t> chunk;  ///< none: in one piece
  bool shuffle = false, checksum = false;
  int deflate = 0;
  bool scaleOffset = false;
  hid_t type = -1;  ///< of the file, else the same as the numbers'
};

/// Makes a file. `newest`: with the newest structures, which have checksums and are short.
class Maker {
 public:
  explicit Maker(const std::string& path, bool newest = false) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (newest) H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
    file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
    H5Pclose(access);
  }
  ~Maker() { H5Fclose(file_); }
  Maker(const Maker&) = delete;
  Maker& operator=(const Maker&) = delete;

  hid_t file() const { return file_; }
  void group(const std::string& name) const {
    H5Gclose(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }

  template <class T>
  void attribute(const std::string& group, const std::string& name, const std::vector<T>& values) const {
    const hsize_t count = values.size();
    const hid_t at = H5Gopen2(file_, group.c_str(), H5P_DEFAULT), space = H5Screate_simple(1, &count, nullptr);
    const hid_t own = H5Acreate2(at, name.c_str(), typeOf<T>(), space, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(own, typeOf<T>(), values.data()), 0);
    H5Aclose(own), H5Sclose(space), H5Gclose(at);
  }
  void text(const std::string& group, const std::string& name, const std::string& value) const {
    const hid_t at = H5Gopen2(file_, group.c_str(), H5P_DEFAULT), space = H5Screate(H5S_SCALAR),
                type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, value.size() + 1);
    const hid_t own = H5Acreate2(at, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(own, type, value.c_str()), 0);
    H5Aclose(own), H5Tclose(type), H5Sclose(space), H5Gclose(at);
  }
  template <class T>
  void array(const std::string& name, std::vector<hsize_t> shape, const std::vector<T>& values,
             Storage storage = {}) const {
    std::vector<hsize_t> most = shape;
    if (!storage.chunk.empty()) most[0] = H5S_UNLIMITED;  // a chunk may then be longer than the array
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), most.data());
    const hid_t plist = H5Pcreate(H5P_DATASET_CREATE);
    if (!storage.chunk.empty()) H5Pset_chunk(plist, static_cast<int>(storage.chunk.size()), storage.chunk.data());
    if (storage.scaleOffset) H5Pset_scaleoffset(plist, H5Z_SO_INT, H5Z_SO_INT_MINBITS_DEFAULT);
    if (storage.shuffle) H5Pset_shuffle(plist);
    if (storage.deflate > 0) H5Pset_deflate(plist, static_cast<unsigned>(storage.deflate));
    if (storage.checksum) H5Pset_fletcher32(plist);
    const hid_t type = storage.type >= 0 ? storage.type : typeOf<T>();
    const hid_t own = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, plist, H5P_DEFAULT);
    EXPECT_GE(own, 0) << name;
    if (!values.empty()) {
      EXPECT_GE(H5Dwrite(own, typeOf<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << name;
    }
    H5Dclose(own), H5Pclose(plist), H5Sclose(space);
  }

 private:
  hid_t file_ = -1;
};

/// The bytes of a file that `fill` makes.
template <class Fill>
std::string made(const Fill& fill, bool newest = false) {
  const TempFolder folder;
  {
    const Maker maker(folder.file("made.hdf5"), newest);
    fill(maker);
  }
  return readBytes(folder.file("made.hdf5"));
}

const std::vector<double> kTwo{1, 2, 3, 4, 5, 6.1};
const std::vector<std::uint64_t> kIds{~0ull, 7};

/// Gas of two particles, as GADGET-4 has it.
void gadget(const Maker& maker, const Storage& vectors = {}, const Storage& numbers = {}) {
  maker.group("Header"), maker.group("PartType0");
  maker.attribute<double>("Header", "MassTable", {0, 0, 0, 0, 0, 0});
  maker.attribute<double>("Header", "Time", {0.25});
  maker.attribute<std::int32_t>("Header", "NumFilesPerSnapshot", {1});
  maker.array<double>("PartType0/Coordinates", {2, 3}, kTwo, vectors);
  maker.array<float>("PartType0/Velocities", {2, 3}, {0, 1, 0, 2, 0, 0}, vectors);
  maker.array<float>("PartType0/SmoothingLength", {2}, {0.5, 0.25}, numbers);
  maker.array<float>("PartType0/Density", {2}, {8, 16}, numbers);
  maker.array<float>("PartType0/Masses", {2}, {1, 2}, numbers);
  maker.array<std::uint64_t>("PartType0/ParticleIDs", {2}, kIds, numbers);
}

/// What our channel gets of a file by names alone.
std::string nameOf(const OpenedFile& opened, const std::string& ours) {
  return nameInFile(ParticleSource(), *opened.file, ours).theirs;
}

TEST(Hdf5Reader, ReadsGasOfGadgetHoweverItIsStored) {
  const Storage vectors[] = {
      {}, {{2, 3}, true, true, 6}, {{1, 2}, true, false, 9}, {{64, 3}, false, true}, {{1, 1}, false, false, 1}};
  for (const Storage& own : vectors)
    for (const bool newest : {false, true}) {
      Storage numbers = own;
      if (!numbers.chunk.empty()) numbers.chunk.resize(1);
      const OpenedFile opened(made([&](const Maker& maker) { gadget(maker, own, numbers); }, newest));
      EXPECT_EQ(opened.file->format(), "HDF5, PartType0");
      EXPECT_EQ(opened.file->count(), 2u);
      EXPECT_EQ(opened.file->channel("Coordinates")->type, NumberType::F64);
      EXPECT_EQ(opened.read<dvec3>("Coordinates"), (std::vector<dvec3>{{1, 2, 3}, {4, 5, 6.1}}));
      EXPECT_EQ(opened.read<vec3>("Velocities"), (std::vector<vec3>{{0, 1, 0}, {2, 0, 0}}));
      EXPECT_EQ(opened.read<std::uint64_t>("ParticleIDs"), kIds);
      EXPECT_EQ(opened.read<float>("MassDensity"), (std::vector<float>{8, 16}));
      EXPECT_EQ(opened.file->meta("", "Time")->bytes, rawNumbers<double>({0.25}));
      EXPECT_EQ(nameOf(opened, "Position"), "Coordinates");
      EXPECT_EQ(nameOf(opened, "Velocity"), "Velocities");
      EXPECT_EQ(nameOf(opened, "Density"), "Masses");  // not the mass per volume, which the file calls Density
      EXPECT_EQ(nameOf(opened, "ID"), "ParticleIDs");
      EXPECT_EQ(opened.read<float>(nameOf(opened, "Radius")), (std::vector<float>{0.5, 0.25}));
    }
}

TEST(Hdf5Reader, ReadsOtherNumbersThanTheMachines) {
  const OpenedFile opened(made([&](const Maker& maker) {
    Storage big, small, scaled{{16, 3}, false, false, 0, true}, deflated{{16, 3}, true, false, 6, true};
    big.type = H5T_IEEE_F64BE, small.type = H5T_STD_U16BE;
    Storage packedBig{{1, 3}, true, false, 6};
    packedBig.type = H5T_STD_I32BE;
    maker.array<double>("Coordinates", {2, 3}, kTwo, big);
    maker.array<std::int32_t>("u16", {2, 3}, {1, 2, 3, 4, 5, 65535}, small);
    maker.array<std::int32_t>("scaled", {2, 3}, {1, 2, 3, 4, 5, -7}, scaled);
    maker.array<std::int32_t>("deflated", {2, 3}, {1, 2, 3, 4, 5, -7}, deflated);
    maker.array<std::int32_t>("big", {2, 3}, {1, 2, 3, 4, 5, -7}, packedBig);
  }));
  EXPECT_EQ(opened.read<dvec3>("Coordinates"), (std::vector<dvec3>{{1, 2, 3}, {4, 5, 6.1}}));
  EXPECT_EQ(opened.read<vec3>("u16"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 65535}}));
  for (const char* name : {"scaled", "deflated", "big"})
    EXPECT_EQ(opened.read<vec3>(name), (std::vector<vec3>{{1, 2, 3}, {4, 5, -7}})) << name;
  EXPECT_EQ(opened.file->channel("u16")->type, NumberType::U16);
}

TEST(Hdf5Reader, WidensTheSmoothingLengthsOfSwiftToTheirSupport) {
  const OpenedFile opened(made([](const Maker& maker) {
    for (const char* group : {"Header", "HydroScheme", "Units", "PartType0"}) maker.group(group);
    maker.text("Header", "Code", "SWIFT");
    maker.attribute<double>("Units", "Unit length in cgs (U_L)", {3.08567758e24});
    maker.attribute<double>("HydroScheme", "Kernel gamma", {2});
    maker.array<double>("PartType0/Coordinates", {2, 3}, kTwo);
    maker.array<float>("PartType0/SmoothingLengths", {2}, {0.5, 0.25});
    maker.array<float>("PartType0/Densities", {2}, {8, 16});
    maker.array<float>("PartType0/Masses", {2}, {1, 2});
  }));
  EXPECT_EQ(opened.file->format(), "HDF5 of SWIFT, PartType0");
  EXPECT_EQ(opened.read<float>("SmoothingLengths"), (std::vector<float>{0.5, 0.25}));
  EXPECT_EQ(opened.read<float>("Radius"), (std::vector<float>{1, 0.5}));
  EXPECT_EQ(nameOf(opened, "Radius"), "Radius");
  EXPECT_EQ(nameOf(opened, "Density"), "Masses");
  EXPECT_NE(opened.file->meta("", "Unit length in cgs (U_L)"), nullptr);
  EXPECT_EQ(opened.file->meta("", "Code")->bytes, "SWIFT");
}

TEST(Hdf5Reader, TakesSwiftsDefaultKernelWhereTheFileNamesNone) {
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  const OpenedFile opened(made([](const Maker& maker) {
    maker.group("Header"), maker.group("PartType0");
    maker.text("Header", "Code", "SWIFT");
    maker.array<double>("PartType0/Coordinates", {2, 3}, kTwo);
    maker.array<double>("PartType0/SmoothingLengths", {2}, {1, 2});
  }));
  EXPECT_EQ(opened.read<double>("Radius"), (std::vector<double>{1.825742, 2 * 1.825742}));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("Kernel gamma"), std::string::npos) << warnings[0];
}

TEST(Hdf5Reader, RefusesAKernelThatIsShorterThanItsSmoothingLength) {
  expectFileRefused(made([](const Maker& maker) {
                      for (const char* group : {"HydroScheme", "PartType0"}) maker.group(group);
                      maker.attribute<double>("HydroScheme", "Kernel gamma", {0.5});
                      maker.array<double>("PartType0/Coordinates", {2, 3}, kTwo);
                      maker.array<double>("PartType0/SmoothingLengths", {2}, {1, 2});
                    }),
                    {"Kernel gamma", "got 0.5"});
}

TEST(Hdf5Reader, TakesTheRadiusFromTheVolumeWhereThereIsNoSmoothingLength) {
  for (const bool table : {false, true}) {
    const OpenedFile opened(made([&](const Maker& maker) {
      maker.group("Header"), maker.group("PartType0");
      maker.attribute<double>("Header", "MassTable", {table ? 2.0 : 0, 0, 0});
      maker.array<double>("PartType0/Coordinates", {2, 3}, kTwo);
      maker.array<float>("PartType0/Density", {2}, {2, 16});
      if (!table) maker.array<float>("PartType0/Masses", {2}, {2, 2});
    }));
    EXPECT_EQ(opened.read<float>("Radius"), (std::vector<float>{1.5, 0.75}));
    EXPECT_EQ(opened.read<float>("Masses"), (std::vector<float>{2, 2}));
  }
}

TEST(Hdf5Reader, TakesTheOnlyTypeOfParticlesWhereThereIsNoGas) {
  const auto dark = [](bool stars) {
    return made([&](const Maker& maker) {
      for (const char* group : {"Header", "PartType0", "PartType1", "PartType4"}) maker.group(group);
      maker.attribute<double>("Header", "MassTable", {0, 3, 0, 0, 0, 0});
      maker.array<float>("PartType0/Coordinates", {0, 3}, {});
      maker.array<float>("PartType1/Coordinates", {2, 3}, {1, 2, 3, 4, 5, 6});
      if (stars) maker.array<float>("PartType4/Coordinates", {1, 3}, {1, 2, 3});
    });
  };
  const OpenedFile opened(dark(false));
  EXPECT_EQ(opened.file->format(), "HDF5, PartType1");
  EXPECT_EQ(opened.read<vec3>("Coordinates"), (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(opened.read<float>("Masses"), (std::vector<float>{3, 3}));
  expectFileRefused(dark(true), {"gas (PartType0)", "PartType0 (0), PartType1 (2), PartType4 (1)"});
  expectFileRefused(made([](const Maker& maker) { maker.group("PartType0"); }), {"no particles: PartType0 (0)"});
}

TEST(Hdf5Reader, JoinsTheFilesOfASnapshot) {
  const TempFolder folder;
  const auto write = [&](int k, const std::vector<float>& x, bool other = false) {
    const Maker maker(folder.file("snap_007." + std::to_string(k) + ".hdf5"));
    maker.group("Header");
    maker.attribute<std::int32_t>("Header", "NumFilesPerSnapshot", {3});
    if (x.empty()) return;  // a file may have no gas
    maker.group("PartType0");
    maker.array<float>("PartType0/Coordinates", {x.size() / 3, 3}, x);
    maker.array<float>("PartType0/Masses", {x.size() / 3}, std::vector<float>(x.size() / 3, static_cast<float>(k)));
    if (other) maker.array<float>("PartType0/Metallicity", {x.size() / 3}, std::vector<float>(x.size() / 3));
  };
  const auto refused = [&](const std::string& name, const std::string& word) {
    try {
      openParticleFile(folder.file(name));
      ADD_FAILURE() << word;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  write(1, {});
  refused("snap_007.1.hdf5", "no snap_007.0.hdf5, snap_007.2.hdf5");
  write(0, {1, 2, 3}, true), write(2, {4, 5, 6, 7, 8, 9});
  for (const int k : {0, 1, 2}) {
    std::vector<std::string> warnings;
    const WarningsKept kept(warnings);
    const auto file = openParticleFile(folder.file("snap_007." + std::to_string(k) + ".hdf5"));
    EXPECT_EQ(file->format(), "HDF5, PartType0 in 3 files");
    std::vector<vec3> positions;
    std::vector<float> masses;
    const ChannelRequest requests[] = {{"Coordinates", &positions}, {"Masses", &masses}};
    file->read(requests);
    EXPECT_EQ(positions, (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
    EXPECT_EQ(masses, (std::vector<float>{0, 2, 2}));
    EXPECT_EQ(file->channel("Metallicity"), nullptr);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("Metallicity, which is not in all files"), std::string::npos) << warnings[0];
  }
  std::filesystem::rename(folder.file("snap_007.0.hdf5"), folder.file("mine.hdf5"));
  refused("mine.hdf5", "a name like mine.0.hdf5");
}

TEST(Hdf5Reader, ReadsArraysInTheRootOfPlainFiles) {
  const OpenedFile opened(made([](const Maker& maker) {
    maker.array<float>("position", {2, 3}, {1, 2, 3, 4, 5, 6});
    maker.array<float>("velocity", {2, 3}, {0, 0, 1, 0, 1, 0});
    maker.array<float>("other", {5}, {1, 2, 3, 4, 5});
  }));
  EXPECT_EQ(opened.file->format(), "HDF5");
  EXPECT_EQ(describeChannels(opened.file->channels()), "position (3 × float32), velocity (3 × float32)");
  EXPECT_EQ(nameOf(opened, "Position"), "position");
  const OpenedFile lonely(made([](const Maker& maker) {
    maker.array<float>("xyz", {2, 3}, {1, 2, 3, 4, 5, 6});
    maker.array<float>("m", {2}, {1, 2});
  }));
  EXPECT_EQ(describeChannels(lonely.file->channels()), "m (float32), xyz (3 × float32)");
  expectFileRefused(made([](const Maker& maker) {
                      maker.array<float>("a", {2, 3}, {1, 2, 3, 4, 5, 6});
                      maker.array<float>("b", {1, 3}, {1, 2, 3});
                      maker.group("stuff");
                    }),
                    {"N × 3", "a (2 × 3), b (1 × 3)", "groups stuff", "h5py"});
}

TEST(Hdf5Reader, ReadsManyRowsInPieces) {
  constexpr std::size_t kRows = 500000;  // more than a block
  std::vector<double> values(3 * kRows);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = static_cast<double>(k);
  for (const Storage& storage : {Storage{}, Storage{{1000, 3}, true, false, 1}, Storage{{300000, 3}, true, true, 1}}) {
    const OpenedFile opened(made([&](const Maker& maker) {
      maker.array<double>("Coordinates", {kRows, 3}, values, storage);
    }));
    const std::vector<std::byte> raw = opened.read<std::byte>("Coordinates");
    ASSERT_EQ(raw.size(), values.size() * sizeof(double));
    EXPECT_EQ(std::memcmp(raw.data(), values.data(), raw.size()), 0);
  }
}

/// Short ones, to be damaged in every way.
std::string two(bool newest) {
  const auto fill = [](const Maker& maker) {
    maker.array<float>("Coordinates", {2, 3}, {1, 2, 3, 4, 5, 6}, {{2, 3}, true, false, 6});
    maker.array<float>("m", {2}, {1, 2});
  };
  return made(fill, newest);
}

TEST(Hdf5Reader, RefusesTruncationAtEveryByte) {
  for (const bool newest : {false, true}) {
    const std::string whole = two(newest);
    for (std::size_t size = 0; size < whole.size(); ++size) expectFileRefused(whole.substr(0, size), {"particles"});
    expectFileRefused(whole.substr(0, 60), {std::to_string(whole.size()) + " bytes", "got 60", "the file is cut off"});
  }
}

TEST(Hdf5Reader, SurvivesDamage) {
  // A file is opened in a process of its own, which takes a while, and most of it is room for more: a bit of every byte
  // that says something, and every 16th that does not.
  for (const bool newest : {false, true}) {
    const std::string whole = two(newest);
    std::size_t refused = 0;
    std::vector<std::string> warnings;
    const WarningsKept kept(warnings);
    for (std::size_t k = 0; k < whole.size(); ++k) {
      if (whole[k] == 0 && k % 16 != 0) continue;
      std::string bytes = whole;
      bytes[k] = static_cast<char>(bytes[k] ^ (whole[k] == 0 ? 255 : 1 << k % 8));
      try {
        const OpenedFile opened(bytes);
        EXPECT_LE(opened.file->count(), 10000u) << k;
        opened.readAll();
      } catch (const InputError&) {
        ++refused;
      }
    }
    EXPECT_GT(refused, 0u);
  }
}

TEST(Hdf5Reader, RefusesArraysThatTheFileCannotHold) {
  // Never written: a header alone says that there are so many.
  for (const Storage& storage : {Storage{}, Storage{{1 << 20, 3}, true, false, 6}})
    expectFileRefused(made([&](const Maker& maker) {
                        maker.group("PartType0");
                        maker.array<float>("PartType0/Coordinates", {hsize_t{1} << 40, 3}, {}, storage);
                      }),
                      {"PartType0/Coordinates", "Coordinates (1099511627776 × 3)"});
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  const OpenedFile opened(made([&](const Maker& maker) {
    gadget(maker);
    maker.array<float>("PartType0/Never", {2}, {});
    maker.array<float>("PartType0/Short", {1}, {1});
  }));
  EXPECT_EQ(opened.file->channel("Never"), nullptr);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("Never, which has more numbers than the file holds"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("Short, which has 1 rows for 2 particles"), std::string::npos) << warnings[1];
}

TEST(Hdf5Reader, RefusesAChunkThatUnpacksToMoreThanItsSize) {
  // A chunk of 24 bytes that stands for 16 MiB of zeros: libhdf5 by itself would let it grow.
  std::vector<unsigned char> bomb(1 << 15);
  std::string zeros(1 << 24, '\0');
  uLongf size = bomb.size();
  ASSERT_EQ(compress(bomb.data(), &size, reinterpret_cast<const Bytef*>(zeros.data()), zeros.size()), Z_OK);
  expectFileRefused(made([&](const Maker& maker) {
                      maker.array<float>("Coordinates", {2, 3}, {}, {{2, 3}, false, false, 6});
                      const hid_t dataset = H5Dopen2(maker.file(), "Coordinates", H5P_DEFAULT);
                      const hsize_t at[2] = {0, 0};
                      EXPECT_GE(H5Dwrite_chunk(dataset, H5P_DEFAULT, 0, at, size, bomb.data()), 0);
                      H5Dclose(dataset);
                    }),
                    {"Coordinates, row 0 on", "a chunk that zlib cannot unpack to its size"});
}

TEST(Hdf5Reader, FollowsNoLinkIntoOtherFiles) {
  const TempFolder folder;
  writeBytes(folder.file("other.hdf5"), made([](const Maker& maker) {
               maker.array<float>("Coordinates", {2, 3}, {1, 2, 3, 4, 5, 6});
             }));
  writeBytes(folder.file("linked.hdf5"), made([](const Maker& maker) {
               H5Lcreate_external("other.hdf5", "/Coordinates", maker.file(), "Coordinates", H5P_DEFAULT, H5P_DEFAULT);
               H5Lcreate_soft("/Coordinates", maker.file(), "position", H5P_DEFAULT, H5P_DEFAULT);
               H5Lcreate_soft("/loop", maker.file(), "loop", H5P_DEFAULT, H5P_DEFAULT);
             }));
  EXPECT_EQ(openParticleFile(folder.file("other.hdf5"))->count(), 2u);
  EXPECT_THROW(openParticleFile(folder.file("linked.hdf5")), InputError);
  writeBytes(folder.file("raw"), rawNumbers<float>({1, 2, 3, 4, 5, 6}));
  expectFileRefused(made([&](const Maker& maker) {
                      const hsize_t shape[2] = {2, 3};
                      const hid_t space = H5Screate_simple(2, shape, nullptr), plist = H5Pcreate(H5P_DATASET_CREATE);
                      H5Pset_external(plist, folder.file("raw").c_str(), 0, 24);
                      const hid_t own = H5Dcreate2(maker.file(), "Coordinates", H5T_IEEE_F32LE, space, H5P_DEFAULT,
                                                   plist, H5P_DEFAULT);
                      H5Dclose(own), H5Pclose(plist), H5Sclose(space);
                    }),
                    {"numbers that the file holds"});
}

TEST(Hdf5Reader, SaysWhichFilesHaveTheNumbersOfAVirtualOne) {
  expectFileRefused(made(
                        [&](const Maker& maker) {
                          const hsize_t shape[2] = {2, 3};
                          const hid_t space = H5Screate_simple(2, shape, nullptr),
                                      plist = H5Pcreate(H5P_DATASET_CREATE);
                          H5Pset_virtual(plist, space, "snap_0000.0.hdf5", "/PartType0/Coordinates", space);
                          maker.group("PartType0");
                          const hid_t own = H5Dcreate2(maker.file(), "PartType0/Coordinates", H5T_IEEE_F32LE, space,
                                                       H5P_DEFAULT, plist, H5P_DEFAULT);
                          H5Dclose(own), H5Pclose(plist), H5Sclose(space);
                        },
                        true),
                    {"snap_0000.0.hdf5", "give that file"});
}

TEST(Hdf5Reader, PrintsNothingOfItsLibrary) {
  ::testing::internal::CaptureStderr();
  std::string whole = two(true);
  whole[12] = 1;  // the superblock's, whose checksum is then another
  expectFileRefused(whole, {"a file that libhdf5 opens", "checksum"});
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

#endif

}  // namespace
}  // namespace mote
