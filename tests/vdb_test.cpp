// OpenVDB files: what the reader accepts and refuses. OpenVDB itself writes them.
#include "host/particles/formats/vdb_reader.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <cstring>
#include <map>

#include "host/particles/particle_loader.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"
#include "tests/support/volume_facts.h"

namespace mote {
namespace {

using namespace test;
namespace io = openvdb::io;
namespace points = openvdb::points;

constexpr std::uint32_t kCompressions[] = {io::COMPRESS_NONE, io::COMPRESS_ZIP, io::COMPRESS_ACTIVE_MASK,
                                           io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK,
                                           io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK};

std::string vdb(const openvdb::GridPtrVec& grids,
                std::uint32_t compression = io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK) {
  const TempFolder folder;
  // OpenVDB zips no fog volumes; other programs do, and smoke1 is.
  for (const openvdb::GridBase::Ptr& grid : grids)
    if ((compression & io::COMPRESS_ZIP) && grid->getGridClass() == openvdb::GRID_FOG_VOLUME)
      grid->setGridClass(openvdb::GRID_UNKNOWN);
  io::File file(folder.file("grid.vdb"));
  file.setCompression(compression);
  file.write(grids);
  file.close();
  return readBytes(folder.file("grid.vdb"));
}

/// A slab with some tiles of 8³ and voxels beside, in voxels of half a unit.
template <class Grid = openvdb::FloatGrid>
typename Grid::Ptr fog(const std::string& name = "density") {
  openvdb::initialize();
  const auto grid = Grid::create();
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  grid->transform().postTranslate(openvdb::Vec3d(10, 20, 30));
  using Value = typename Grid::ValueType;
  grid->sparseFill(openvdb::CoordBBox({-8, 0, 0}, {15, 7, 7}), Value(0.5));
  for (int x = 16; x < 24; ++x) grid->tree().setValue({x, 3, 4}, Value(0.125 * (x - 15)));
  return grid;
}
constexpr double kFogIntegral = (3 * 512 * 0.5 + 0.125 * 36) / 8;  // of the values above, voxels of 1/8 unit³
constexpr std::uint64_t kFogVoxels = 3 * 512 + 8;

TEST(VdbReader, DrawsAFogVolumeWithItsTilesInEveryCompression) {
  for (const std::uint32_t compression : kCompressions) {
    const OpenedFile drawn(vdb({fog()}, compression), {.count = 5000, .seed = 3, .grid = ""});
    EXPECT_EQ(drawn.file->format(), "OpenVDB 10.0 (fog volume)");
    EXPECT_TRUE(drawn.file->drawn());
    EXPECT_EQ(describeChannels(drawn.file->channels()), "Position (3 × float64), Density (float32), Radius (float32)");
    EXPECT_EQ(metadataNumber(*drawn.file, "active_voxels"), kFogVoxels);
    EXPECT_EQ(metadataNumber(*drawn.file, "tile_voxels"), 3 * 512);
    EXPECT_NEAR(metadataNumber(*drawn.file, "integral"), kFogIntegral, 1e-12);
    EXPECT_NEAR(densitySum(drawn) / kFogIntegral, 1, 1e-7) << compression;
    for (const dvec3& p : drawn.read<dvec3>("Position")) {
      ASSERT_TRUE(p.x >= 10 - 4.25 && p.x < 10 + 11.75 && p.y >= 19.75 && p.y < 23.75) << p.x << " " << p.y;
      ASSERT_TRUE(p.z >= 29.75 && p.z < 33.75) << p.z;
    }
  }
  EXPECT_EQ(OpenedFile(vdb({fog()})).file->count(), kFogVoxels);
}

TEST(VdbReader, ReadsHalfAndDouble) {
  const auto half = fog();
  half->setSaveFloatAsHalf(true);
  for (const std::uint32_t compression : kCompressions) {
    EXPECT_NEAR(densitySum(OpenedFile(vdb({half}, compression))) / kFogIntegral, 1, 1e-7);
    EXPECT_NEAR(densitySum(OpenedFile(vdb({fog<openvdb::DoubleGrid>()}, compression))) / kFogIntegral, 1, 1e-7);
  }
}

TEST(VdbReader, PlacesParticlesThroughAnyLinearTransform) {
  const openvdb::math::Mat4d turned(0., 2., 0., 0., /**/ -3., 0., 0., 0., /**/ 0., 0.5, 4., 0., /**/ 7., 8., 9., 1.);
  const auto grid = fog();
  for (const auto& transform : {openvdb::math::Transform::createLinearTransform(turned),
                                openvdb::math::Transform::createLinearTransform(0.25)}) {
    grid->setTransform(transform);
    const OpenedFile drawn(vdb({grid}), {.count = 2000, .seed = 1, .grid = ""});
    const openvdb::Vec3d edges = transform->voxelSize();
    const double volume = transform->mapType() == "AffineMap" ? 24 : edges.x() * edges.y() * edges.z();
    EXPECT_NEAR(densitySum(drawn) / (kFogIntegral * 8 * volume), 1, 1e-7);
    for (const dvec3& p : drawn.read<dvec3>("Position")) {
      const openvdb::Coord at = transform->worldToIndexCellCentered(openvdb::Vec3d(p.x, p.y, p.z));
      ASSERT_TRUE(grid->tree().isValueOn(at)) << at;
    }
  }
}

TEST(VdbReader, SamplesVelocitiesWhereTheParticlesAre) {
  for (const char* name : {"v", "vel", "velocity"}) {
    const auto velocity = openvdb::Vec3SGrid::create();
    velocity->setName(name);
    velocity->setTransform(fog()->transformPtr());
    for (int x = -12; x < 28; ++x)
      for (int y = -4; y < 12; ++y)
        for (int z = -4; z < 12; ++z) velocity->tree().setValue({x, y, z}, openvdb::Vec3s(float(x), float(2 * y), 1));
    const OpenedFile drawn(vdb({fog(), velocity}), {.count = 500, .seed = 1, .grid = ""});
    const std::vector<dvec3> at = drawn.read<dvec3>("Position");
    const std::vector<vec3> v = drawn.read<vec3>("Velocity");
    for (std::size_t i = 0; i < at.size(); ++i) {  // linear, so trilinear sampling is exact
      ASSERT_NEAR(v[i].x, (at[i].x - 10) * 2, 1e-4);
      ASSERT_NEAR(v[i].y, (at[i].y - 20) * 4, 1e-4);
      ASSERT_FLOAT_EQ(v[i].z, 1);
    }
  }
}

TEST(VdbReader, ChoosesAGridByName) {
  const auto thin = fog("thin");
  for (auto value = thin->beginValueOn(); value; ++value) value.setValue(*value * 0.5f);
  const std::string both = vdb({fog("thick"), thin});
  EXPECT_NEAR(densitySum(OpenedFile(both, {.count = {}, .seed = 0, .grid = "thin"})) / kFogIntegral, 0.5, 1e-7);
  expectFileRefused(both, {"grid: expected which of its grids is meant: 'thick', 'thin'", "\"grid\": \"thick\""});
  expectFileRefused(both, {"grid: expected", "'thick', 'thin'", "got 'smoke'"},
                    {.count = {}, .seed = 0, .grid = "smoke"});
  EXPECT_NEAR(densitySum(OpenedFile(vdb({thin, fog("density")}))) / kFogIntegral, 1, 1e-7);  // density without a word
  EXPECT_NEAR(
      densitySum(OpenedFile(vdb({fog("d"), fog("d")}), {.count = {}, .seed = 0, .grid = "d[1]"})) / kFogIntegral, 1,
      1e-7);
}

TEST(VdbReader, ReadsAGridThatSharesItsTree) {
  const auto first = fog("a"), second = openvdb::FloatGrid::create(*first);
  second->setName("b");
  second->setTree(first->treePtr());
  second->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  const std::string bytes = vdb({first, second});
  EXPECT_NEAR(densitySum(OpenedFile(bytes, {.count = {}, .seed = 0, .grid = "a"})) / kFogIntegral, 1, 1e-7);
  EXPECT_NEAR(densitySum(OpenedFile(bytes, {.count = {}, .seed = 0, .grid = "b"})) / kFogIntegral, 8, 1e-6);
}

TEST(VdbReader, SaysWhatItDoesNotRead) {
  openvdb::initialize();
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0), 0.3f);
  sphere->setName("surface");
  expectFileRefused(vdb({sphere}), {"a fog volume", "'surface' (a level set", "is a surface"});
  expectFileRefused(vdb({sphere, fog()}), {"grid: expected", "a level set"},
                    {.count = {}, .seed = 0, .grid = "surface"});
  EXPECT_NEAR(densitySum(OpenedFile(vdb({sphere, fog()}))) / kFogIntegral, 1, 1e-7);
  const auto flags = openvdb::BoolGrid::create();
  flags->setName("flags");
  expectFileRefused(vdb({flags}), {"'flags' (Tree_bool_5_4_3)"});
  const auto frustum = fog();
  frustum->setTransform(
      openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 2));
  expectFileRefused(vdb({frustum}), {"a camera's frustum"});
  std::string version = vdb({fog()});
  version[8] = static_cast<char>(221);
  expectFileRefused(version, {"OpenVDB file version: expected 222 to 224", "got 221"});
  const TempFolder folder;
  {
    std::ofstream stream(folder.file("stream.vdb"), std::ios::binary);
    io::Stream(stream).write(openvdb::GridCPtrVec{fog()});
  }
  expectFileRefused(readBytes(folder.file("stream.vdb")), {"written as a stream"});
  const auto none = openvdb::FloatGrid::create();
  none->setName("density");
  expectFileRefused(vdb({none}), {"a density somewhere", "0 active voxels"});
}

// ---- points ----

const std::vector<openvdb::Vec3d> kPlaces{{10.1, 20.2, 30.3}, {10.2, 20.2, 30.3}, {-100.5, 0.25, 3}, {11, 21, 31}};

/// The four above, with attributes in several codecs.
template <class Codec = points::NullCodec>
openvdb::GridBase::Ptr pointGrid() {
  openvdb::initialize();
  const auto transform = openvdb::math::Transform::createLinearTransform(0.5);
  const points::PointAttributeVector<openvdb::Vec3d> places(kPlaces);
  const auto index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(places, *transform);
  const auto grid = points::createPointDataGrid<Codec, points::PointDataGrid>(*index, places, *transform);
  grid->setName("points");
  const auto add = [&]<class T>(const char* name, const std::vector<T>& values, auto codec) {
    points::appendAttribute<T, decltype(codec)>(grid->tree(), name);
    points::populateAttribute<points::PointDataTree, openvdb::tools::PointIndexTree, points::PointAttributeVector<T>>(
        grid->tree(), index->tree(), name, points::PointAttributeVector<T>(values));
  };
  add("pscale", std::vector<float>{0.5, 0.25, 1, 0.75}, points::TruncateCodec());
  add("v", std::vector<openvdb::Vec3f>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}}, points::NullCodec());
  add("Cd", std::vector<openvdb::Vec3f>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}},
      points::FixedPointCodec<true, points::UnitRange>());
  add("id", std::vector<int>{7, 8, 9, 10}, points::NullCodec());
  add("twice", std::vector<double>{1e300, 2, 3, 4}, points::NullCodec());
  points::appendAttribute<std::int64_t>(grid->tree(), "all", std::int64_t{5});  // uniform
  points::appendGroup(grid->tree(), "some");
  return grid;
}

/// By id, as the order is that of leaves.
void expectTheFour(const OpenedFile& opened, double tolerance) {
  ASSERT_EQ(opened.file->count(), 4u);
  EXPECT_FALSE(opened.file->drawn());
  EXPECT_EQ(opened.file->format(), "OpenVDB 10.0 (points)");
  EXPECT_EQ(describeChannels(opened.file->channels()),
            "Position (3 × float64), Cd (3 × float32), all (int64), id (int32), pscale (float32), twice (float64), "
            "v (3 × float32)");
  const auto ids = opened.read<std::uint64_t>("id");
  const auto places = opened.read<dvec3>("Position");
  const auto sizes = opened.read<float>("pscale");
  const auto v = opened.read<vec3>("v"), colours = opened.read<vec3>("Cd");
  const auto twice = opened.read<double>("twice");
  EXPECT_EQ(opened.read<std::uint64_t>("all"), (std::vector<std::uint64_t>(4, 5)));
  const float expectedSizes[] = {0.5, 0.25, 1, 0.75};
  const double expectedTwice[] = {1e300, 2, 3, 4};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t k = ids[i] - 7;
    ASSERT_LT(k, 4u);
    EXPECT_NEAR(places[i].x, kPlaces[k].x(), tolerance);
    EXPECT_NEAR(places[i].y, kPlaces[k].y(), tolerance);
    EXPECT_NEAR(places[i].z, kPlaces[k].z(), tolerance);
    EXPECT_EQ(sizes[i], expectedSizes[k]);
    EXPECT_EQ(v[i], vec3(3 * k + 1, 3 * k + 2, 3 * k + 3));
    EXPECT_EQ(twice[i], expectedTwice[k]);
    EXPECT_EQ(colours[i], k == 3 ? vec3(1) : vec3(k == 0, k == 1, k == 2));
  }
}

TEST(VdbReader, ReadsPointsInEveryCodecAndCompression) {
  for (const std::uint32_t compression : kCompressions) {
    expectTheFour(OpenedFile(vdb({pointGrid()}, compression)), 1e-7);  // places in a voxel are float
    expectTheFour(OpenedFile(vdb({pointGrid<points::FixedPointCodec<false, points::PositionRange>>()}, compression)),
                  0.5 / 65535);
    expectTheFour(OpenedFile(vdb({pointGrid<points::FixedPointCodec<true, points::PositionRange>>()}, compression)),
                  0.5 / 255);
  }
}

TEST(VdbReader, PrefersPointsToVolumesAndRefusesToDrawFromThem) {
  const std::string both = vdb({fog(), pointGrid()});
  expectTheFour(OpenedFile(both), 1e-7);
  EXPECT_NEAR(densitySum(OpenedFile(both, {.count = {}, .seed = 0, .grid = "density"})) / kFogIntegral, 1, 1e-7);
  expectFileRefused(both, {"count: expected none", "holds 4 particles already", "got 5", "for volumes"},
                    {.count = 5, .seed = 0, .grid = ""});
  expectFileRefused("1,2,3\n4,5,6\n", {"count: expected none", "got 5"}, {.count = 5, .seed = 0, .grid = ""});
  expectFileRefused("1,2,3\n4,5,6\n", {"seed: expected none", "got 2"}, {.count = {}, .seed = 2, .grid = ""});
  expectFileRefused("1,2,3\n4,5,6\n", {"grid: expected none", "got 'a'"}, {.count = {}, .seed = 0, .grid = "a"});
}

TEST(VdbReader, ReadsManyPointsInManyLeaves) {
  openvdb::initialize();
  std::vector<openvdb::Vec3f> places;
  for (int i = 0; i < 30000; ++i)
    places.emplace_back(static_cast<float>(i % 40), static_cast<float>(i / 40 % 25), static_cast<float>(i / 1000));
  const auto transform = openvdb::math::Transform::createLinearTransform(0.7);
  const auto grid = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(places, *transform);
  const OpenedFile opened(vdb({grid}));
  ASSERT_EQ(opened.file->count(), places.size());
  std::vector<bool> seen(places.size());
  for (const dvec3& p : opened.read<dvec3>("Position")) {
    const dvec3 whole = glm::round(p);
    ASSERT_LT(glm::length(p - whole), 1e-6);
    seen[static_cast<std::size_t>(whole.x + 40 * whole.y + 1000 * whole.z)] = true;
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 30000);
}

TEST(VdbReader, ReadsPointsOfOthersThroughTheLoader) {
  ParticleSource source;
  source.file = sharedFile("vdb_points/pointgrid.vdb");
  const ParticleSet set = loadParticles({source}, 1);
  ASSERT_EQ(set.size(), 1024u);  // as its PROVENANCE has it
  EXPECT_NEAR(set.bounds().lo.x, -4, 0.05);
  EXPECT_NEAR(set.bounds().hi.y, 4, 0.05);
  EXPECT_EQ(set.color.size(), 1024u);
  EXPECT_EQ(set.velocity.size(), 1024u);
  EXPECT_EQ(set.radius.size(), 1024u);
}

// ---- smoke1 ----

const char* kSmoke = "smoke1/smoke.vdb";

ParticleSet smoke(std::uint64_t count, std::uint64_t seed) {
  ParticleSource source;
  source.file = sharedFile(kSmoke);
  source.count = count, source.seed = seed;
  return loadParticles({source}, 1);
}

double sumOf(const ParticleSet& set) {
  double sum = 0;
  for (const float d : set.density) sum += static_cast<double>(d);
  return sum;
}

TEST(VdbReader, KeepsTheIntegralOfSmokeForAnyCountAndSeed) {
  ParticleSource others;
  others.file = sharedFile("smoke1/smoke1_350k_power05.prt");
  const double integral = sumOf(loadParticles({others}, 1));  // 18518.5, as its README has it
  EXPECT_NEAR(integral, 18518.5, 0.05);
  for (const std::uint64_t count : {1u, 1000u, 350'000u})
    for (const std::uint64_t seed : {0u, 7u})  // 1e-6: what float32 left of the other's sum
      EXPECT_NEAR(sumOf(smoke(count, seed)) / integral, 1, 1e-6) << count << " of seed " << seed;
  EXPECT_EQ(openParticleFile(sharedFile(kSmoke))->count(), 1'000'000u);  // of 1,049,275 voxels
}

TEST(VdbReader, PutsSmokeWhereOthersDo) {
  ParticleSource source;
  source.file = sharedFile("smoke1/smoke1_350k_power05.prt");
  const ParticleSet theirs = loadParticles({source}, 1), ours = smoke(350'000, 7);
  // Cells of 8 voxels; theirs spread a voxel's particles as a tent, over its neighbours, so that cells' borders leak a
  // little: 16 voxels as cells keep that below what chance does.
  constexpr double kCell = 16 * 0.476;
  struct Cell {
    double ours = 0, theirs = 0, variance = 0;
  };
  std::map<std::tuple<int, int, int>, Cell> cells;
  const auto add = [&](const ParticleSet& set, bool isOurs) {
    for (std::size_t i = 0; i < set.size(); ++i) {
      const dvec3 c = glm::floor(dvec3(set.position[i]) / kCell);
      Cell& cell = cells[{static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z)}];
      const auto d = static_cast<double>(set.density[i]);
      (isOurs ? cell.ours : cell.theirs) += d, cell.variance += d * d;
    }
  };
  add(ours, true), add(theirs, false);
  double chi = 0;
  for (const auto& [place, cell] : cells) chi += (cell.ours - cell.theirs) * (cell.ours - cell.theirs) / cell.variance;
  const auto degrees = static_cast<double>(cells.size());
  EXPECT_GT(degrees, 300);
  // Both are stratified, so the statistic is well below that of independent draws; six deviations above is a defect.
  EXPECT_LT(chi, degrees + 6 * std::sqrt(2 * degrees));
}

// ---- damage ----

TEST(VdbReader, RefusesTruncationAtEveryByte) {
  for (const std::string& whole : {vdb({fog()}), vdb({pointGrid()})})
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_THROW(OpenedFile(whole.substr(0, size), {}).readAll(), InputError) << size << " of " << whole.size();
}

/// Every bit near a byte that is not 0, and of the long masks of nothing between them every 211th byte.
void expectFlippedBitsSurvived(const std::string& whole, const VolumeSampling& sampling, std::uint64_t mostParticles) {
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  std::size_t refused = 0, flipped = 0, zeros = 0;
  for (std::size_t byte = 0; byte < whole.size(); ++byte) {
    zeros = whole[byte] == 0 ? zeros + 1 : 0;
    if (zeros > 8 && byte % 211 != 0) continue;
    for (int bit = 0; bit < 8; ++bit, ++flipped) {
      std::string bytes = whole;
      bytes[byte] = static_cast<char>(bytes[byte] ^ 1 << bit);
      try {
        const OpenedFile opened(bytes, sampling);
        EXPECT_LE(opened.file->count(), mostParticles) << "byte " << byte << " bit " << bit;
        opened.readAll();
      } catch (const InputError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, flipped / 10);
}

/// OpenVDB loses the memory of a node whose values it cannot unpack (which only a leak checker sees).
TEST(VdbReader, TriesOutPackedValuesOfNodes) {
  for (const auto& [compression, magic] : {std::pair<std::uint32_t, std::string>(io::COMPRESS_ZIP, "\x78\x9c"),
                                           std::pair<std::uint32_t, std::string>(io::COMPRESS_BLOSC, "\x02\x01")}) {
    std::string bytes = vdb({fog()}, compression);
    const std::size_t packed = bytes.find(magic, bytes.find("Tree_float_5_4_3") + 64);
    ASSERT_NE(packed, std::string::npos);
    bytes.replace(packed + (magic[0] == 2 ? 20 : 2), 4, "\xff\xff\xff\xff");
    expectFileRefused(bytes, {"packed values at byte", "the file is damaged"});
  }
}

/// OpenVDB goes through all nodes in each pass, of which a file without points may claim 65535.
TEST(VdbReader, RefusesPassesWithoutEnd) {
  const auto empty = points::PointDataGrid::create();
  empty->setName("points");
  empty->tree().addTile(2, {0, 0, 0}, 0, false);  // a node of 4096³ voxels with nothing in it
  std::string bytes = vdb({empty});
  EXPECT_EQ(OpenedFile(bytes).file->count(), 0u);
  std::size_t refused = 0;
  for (std::size_t at = bytes.size() - 2; at > bytes.size() - 64; --at) {
    std::string hostile = bytes;
    hostile.replace(at, 2, "\xff\xff");
    try {
      OpenedFile(hostile).readAll();
    } catch (const InputError& error) {
      refused += std::string(error.what()).find("number of passes at byte") != std::string::npos;
    }
  }
  EXPECT_EQ(refused, 1u);
}

TEST(VdbReader, SurvivesFlippedBitsInVolumes) {
  const auto half = fog();
  half->setSaveFloatAsHalf(true);
  const VolumeSampling sampling{.count = 16, .seed = 0, .grid = ""};
  expectFlippedBitsSurvived(vdb({fog()}), sampling, 16);
  expectFlippedBitsSurvived(vdb({half}, io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK), sampling, 16);
}

TEST(VdbReader, SurvivesFlippedBitsInPoints) {
  expectFlippedBitsSurvived(vdb({pointGrid()}), {}, 4);
  expectFlippedBitsSurvived(vdb({pointGrid<points::FixedPointCodec<true, points::PositionRange>>()}, io::COMPRESS_ZIP),
                            {}, 4);
}

TEST(VdbReader, RefusesSizesThatOpenVdbWouldBelieve) {
  // The size of the first leaf's values, negative: OpenVDB 10 reads so many bytes into a buffer of 2048.
  std::string whole = vdb({fog()}, io::COMPRESS_ZIP);
  const std::string stored = rawNumbers<std::int64_t>({-32768 * 4});
  std::size_t hostile = 0;
  for (std::size_t at = whole.find("UniformScale"); at + 8 <= whole.size(); ++at) {
    std::int64_t size = 0;
    std::memcpy(&size, &whole[at], sizeof size);
    if (size <= 0 || size > 400 || at + 10 > whole.size() || whole[at + 8] != 0x78) continue;  // zlib's head
    for (const std::int64_t wrong :
         {-1'000'000ll, -2049ll, 1ll << 62, -(1ll << 62), std::numeric_limits<long long>::min()}) {
      std::string bytes = whole;
      std::memcpy(&bytes[at], &wrong, sizeof wrong);
      expectFileRefused(bytes, {"at byte"});
      ++hostile;
    }
  }
  EXPECT_GE(hostile, 10u);
}

}  // namespace
}  // namespace mote
