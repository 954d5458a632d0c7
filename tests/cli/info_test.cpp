// mote info: what it says of particle files, pictures and scenes, and how near its estimates are.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/image/exr.h"
#include "host/particles/formats/prt_writer.h"
#include "tests/cli/mote_program.h"

namespace mote {
namespace {

using nlohmann::json;
using namespace test;

const std::string kData = MOTE_SHARED_DATA;

json infoOf(const std::string& path) {
  const ProcessResult result = test::mote({"info", "--json", "--no-measure", path});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  return json::parse(result.out);
}

TEST(MoteInfo, DescribesAParticleFile) {
  const TempFolder folder;
  const json info = infoOf(makeBall(folder));
  EXPECT_EQ(info["kind"], "particles");
  EXPECT_EQ(info["format"], "PRT 1.1");
  EXPECT_EQ(info["count"], 2000);
  EXPECT_EQ(info["bytes_per_particle"], 28);
  ASSERT_EQ(info["channels"].size(), 4u);
  const json& position = info["channels"][0];
  EXPECT_EQ(position["name"], "Position");
  EXPECT_EQ(position["arity"], 3);
  EXPECT_EQ(position["not_finite"], 0);
  for (int axis = 0; axis < 3; ++axis) {
    // 2000 points in the unit ball: the outermost along an axis is within 0.2 of 1 (chance of none in a cap of height
    // 0.2: (1 − 0.028)^2000), the mean within 5 standard errors of 0 (σ = 1/√5, so 0.05).
    EXPECT_GE(position["min"][axis], -1);
    EXPECT_LE(position["min"][axis], -0.8);
    EXPECT_LE(position["max"][axis], 1);
    EXPECT_GE(position["max"][axis], 0.8);
    EXPECT_NEAR(position["mean"][axis].get<double>(), 0, 0.05);
    EXPECT_EQ(info["bounds"]["min"][axis], position["min"][axis]);
  }
  // Equal cross-sections 8π/(3N), as float32.
  EXPECT_NEAR(info["channels"][2]["mean"][0].get<double>(), 8 * M_PI / 3 / 2000, 1e-9);
  EXPECT_EQ(info["radius"]["from"], "channel Radius");
  EXPECT_EQ(info["channels"][3]["name"], "ID");
  EXPECT_EQ(info["channels"][3]["max"][0], 1999);
}

TEST(MoteInfo, PrintsATableForPeople) {
  const TempFolder folder;
  const ProcessResult result = test::mote({"info", makeBall(folder)});
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.err, "");
  for (const char* part :
       {"PRT 1.1, 2000 particles of 28 bytes (56.0 kB)", "3 × float32", "not finite", "bounds", "CoordSys"})
    EXPECT_TRUE(contains(result.out, part));
}

TEST(MoteInfo, CountsNotFiniteNumbersAndKeepsThemOutOfTheStatistics) {
  const TempFolder folder;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<vec3> position{{0, 0, 0}, {1, kNan, 2}, {kInfinity, kNan, 4}, {3, 1, 6}};
  const std::vector<float> density{kNan, kNan, -kInfinity, kNan};
  const std::vector<std::uint64_t> id{0, 1, 18446744073709551615ull, 2};
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(position)),
                                       PrtColumn::of("Density", std::span<const float>(density)),
                                       PrtColumn::of("ID", std::span<const std::uint64_t>(id))};
  writePrt(folder.file("x.prt"), columns);
  const json info = infoOf(folder.file("x.prt"));
  EXPECT_EQ(info["channels"][0]["not_finite"], 2);
  EXPECT_EQ(info["channels"][0]["min"], (json{0, 0, 0}));
  EXPECT_EQ(info["channels"][0]["max"], (json{3, 1, 6}));
  EXPECT_NEAR(info["channels"][0]["mean"][0].get<double>(), 4.0 / 3, 1e-12);
  EXPECT_EQ(info["channels"][1]["not_finite"], 4);
  EXPECT_TRUE(info["channels"][1]["min"][0].is_null());
  EXPECT_EQ(info["channels"][2]["max"][0].get<std::uint64_t>(), 18446744073709551615ull)
      << "64-bit numbers keep all digits";
  // The two that have a place are √(9 + 1 + 36) apart; 1.5 × that is the automatic radius.
  EXPECT_NEAR(info["radius"]["mean"].get<double>(), 1.5 * std::sqrt(46.0), 1e-6);
  EXPECT_TRUE(contains(info["radius"]["from"], "auto"));
}

TEST(MoteInfo, DescribesAFileWithoutParticles) {
  const TempFolder folder;
  const std::vector<vec3> none;
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", std::span<const vec3>(none))};
  writePrt(folder.file("x.prt"), columns);
  const json info = infoOf(folder.file("x.prt"));
  EXPECT_EQ(info["count"], 0);
  EXPECT_TRUE(info["bounds"]["min"][0].is_null());
  EXPECT_EQ(test::mote({"info", folder.file("x.prt")}).exitCode, 0);
}

TEST(MoteInfo, ReadsTheMakersFileAndTheSmoke) {
  const json fractal = infoOf(kData + "/prt/prt_fractal_for_krscene.prt");
  EXPECT_EQ(fractal["count"], 312);
  // The box that its own header gives, to the digits of PROVENANCE.txt.
  EXPECT_NEAR(fractal["bounds"]["min"][2].get<double>(), -1.996, 1e-4);
  EXPECT_NEAR(fractal["bounds"]["max"][1].get<double>(), 1.5374, 1e-4);
  const json smoke = infoOf(kData + "/smoke1/smoke1_350k_power05.prt");
  EXPECT_EQ(smoke["count"], 350'000);
  const json& density = smoke["channels"][1];
  EXPECT_EQ(density["name"], "Density");
  // README of the data: 2.5e-4 … 0.19, sum 18518.5.
  EXPECT_NEAR(density["min"][0].get<double>(), 2.5e-4, 1e-5);
  EXPECT_NEAR(density["max"][0].get<double>(), 0.19, 0.005);
  EXPECT_NEAR(density["mean"][0].get<double>() * 350'000, 18518.5, 0.5);
}

TEST(MoteInfo, RefusesMalformedFilesWithTheirName) {
  for (const std::string name :
       {"massive_chunk_divisible.prt", "massive_chunk_indivisible.prt", "negative_eight.prt"}) {
    const ProcessResult result = test::mote({"info", kData + "/prt/" + name});
    EXPECT_EQ(result.exitCode, 2) << name;
    EXPECT_TRUE(contains(result.err, name + ": metadata chunk 'Metb'"));
    EXPECT_EQ(result.out, "");
  }
}

TEST(MoteInfo, RefusesWhatItCannotRead) {
  const TempFolder folder;
  writeBytes(folder.file("notes.txt"), "hello");
  writeBytes(folder.file("fake.prt"), "no particles at all");
  writeBytes(folder.file("fake.exr"), "no picture at all");
  const std::pair<std::string, std::string> cases[] = {
      {folder.file("notes.txt"), "a particle file (PRT 1.0 and 1.1, PRT 2"},
      {folder.file("fake.prt"), "fake.prt"},
      {folder.file("fake.exr"), "fake.exr"},
      {folder.file("note.txt"), "nearest names in its folder: 'notes.txt'"},
      {folder.path(), "a folder"}};
  for (const auto& [path, message] : cases) {
    const ProcessResult result = test::mote({"info", path});
    EXPECT_EQ(result.exitCode, 2) << path;
    EXPECT_TRUE(contains(result.err, message));
  }
}

TEST(MoteInfo, GivesOneLineOfJsonAFile) {
  const TempFolder folder;
  const std::string ball = makeBall(folder);
  writeExr(folder.file("p.exr"), Image(3, 2, true), {.strings = {{"mote:note", "made here"}}});
  writeBytes(folder.file("s.json"), R"({"particles": [{"file": "ball.prt"}, {"generate": "cloud", "count": 1000}],
    "lights": [{"name": "a", "type": "point", "position": [0, 5, 0], "intensity": 1},
               {"name": "b", "type": "directional", "direction": [0, -1, 0], "irradiance": 1, "casts_shadows": false}]})");
  const ProcessResult result = test::mote({"info", "--json", ball, folder.file("p.exr"), folder.file("s.json")});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  std::vector<json> infos;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) infos.push_back(json::parse(line));
  ASSERT_EQ(infos.size(), 3u);
  EXPECT_EQ(infos[1]["kind"], "picture");
  EXPECT_EQ(infos[1]["width"], 3);
  EXPECT_EQ(infos[1]["height"], 2);
  EXPECT_EQ(infos[1]["channels"].size(), 5u) << "R G B A Z";
  EXPECT_EQ(infos[1]["attributes"]["mote:note"], "made here");
  EXPECT_EQ(infos[2]["kind"], "scene");
  EXPECT_EQ(infos[2]["particles"], 3000);
  EXPECT_EQ(infos[2]["sources"][0]["count"], 2000);
  EXPECT_EQ(infos[2]["lights"].size(), 2u);
  EXPECT_EQ(infos[2]["estimate"]["rays"], 3000) << "one light casts shadows";
  EXPECT_GT(infos[2]["estimate"]["host_bytes"], 3000 * 24);
  EXPECT_GT(infos[2]["estimate"]["seconds"]["lighting"], 0);
  for (const char* name : {"p.exr", "s.json"}) EXPECT_EQ(test::mote({"info", folder.file(name)}).exitCode, 0) << name;
}

TEST(MoteInfo, ShowsTheRangesOfAbsorptionAndEmission) {
  const TempFolder folder;
  const std::vector<vec3> position{{0, 0, 0}, {1, 0, 0}}, absorption{{0, 1, 2}, {3, 0, 0}},
      emission{{5, 6, 7}, {1, 8, 0}};
  const std::vector<PrtColumn> columns{PrtColumn::of("Position", position), PrtColumn::of("Absorption", absorption),
                                       PrtColumn::of("Emission", emission)};
  writePrt(folder.file("x.prt"), columns);
  const json channels = infoOf(folder.file("x.prt"))["channels"];
  EXPECT_EQ(channels[1]["name"], "Absorption");
  EXPECT_EQ(channels[1]["max"], (json{3, 1, 2}));
  EXPECT_EQ(channels[2]["name"], "Emission");
  EXPECT_EQ(channels[2]["min"], (json{1, 6, 0}));
  // Both take memory: 12 bytes a particle each as they are read, and as they are drawn; with absorption also the
  // factors of the colours and the tree's other two channels. A few particles only, so what goes by the pixel is AR AG
  // AB.
  writePrt(folder.file("y.prt"), {columns.data(), 1});
  const auto bytes = [&](const char* file) {
    writeBytes(folder.file("s.json"), R"({"particles": [{"file": ")" + std::string(file) + R"(", "radius": 1}]})");
    return infoOf(folder.file("s.json"))["estimate"]["host_bytes"].get<double>();
  };
  const double colors = 1280.0 * 720 * (12 + 2 * 3);
  EXPECT_EQ(bytes("x.prt") - bytes("y.prt"), 2 * (2 * 12 + 2 * 12 + 12 + 8) + colors);
}

TEST(MoteInfo, CountsTheMemoryOfWhatASceneAdds) {
  const TempFolder folder;
  writeBytes(folder.file("wall.obj"), "v -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\n");
  const auto estimate = [&](const std::string& more) {
    writeBytes(folder.file("s.json"), R"({"particles": [{"generate": "ball", "count": 1000000}],
      "lights": [{"name": "a"}, {"name": "b"}])" +
                                          more + "}");
    return infoOf(folder.file("s.json"))["estimate"];
  };
  const auto more = [&](const char* which, const std::string& part) {
    return estimate(part)[which].get<double>() - estimate("")[which].get<double>();
  };
  const double n = 1e6, pixels = 1280 * 720;
  const std::string solid = R"(, "solids": [{"file": "wall.obj"}])";
  // Light of its own for each particle, splats for one more light, and layers of each light, twice while half is
  // written.
  EXPECT_GE(more("host_bytes", R"(, "output": {"aovs": ["lights"]})"), n * 2 * 12 + pixels * 2 * 12);
  EXPECT_EQ(more("host_bytes", R"(, "output": {"aovs": ["Z", "velocity", "optical_depth", "shadow"]})"),
            pixels * (4 + 8 + 4 + 2 * 4));
  EXPECT_GE(more("host_bytes", R"(, "medium": {"extinction": [1, 2, 3]})"), n * 12 + pixels * 12);
  EXPECT_GE(more("device_bytes", R"(, "medium": {"extinction": [1, 2, 3]})"), n * 12);
  EXPECT_GE(more("host_bytes", solid), pixels * 76) << "surfaces";
  // Nine tenths fewer in the tree, 20 bytes for each receiver.
  EXPECT_LT(more("host_bytes", R"(, "lighting": {"subsample": 0.1})"), 0);
  EXPECT_GT(more("host_bytes", R"(, "lighting": {"subsample": 0.999})"), n * 19);
  // The next frame's particles: position, radius, density, ID.
  EXPECT_EQ(more("host_bytes", R"(, "frames": {"first": 1, "last": 2})"), n * 28);
  // What stands in no header is named.
  EXPECT_EQ(estimate("")["not_counted"].dump(), R"(["a Vulkan driver's own"])");
  EXPECT_TRUE(contains(estimate(solid)["not_counted"].dump(), "the solids' meshes and their tree"));
  EXPECT_TRUE(contains(test::mote({"info", folder.file("s.json"), "--no-measure"}).out,
                       "without the solids' meshes and their tree"));
}

// What a sanitized program takes is mostly the sanitizer's: shadow memory, and what was freed held back.
#if !defined(__SANITIZE_ADDRESS__)
/// The estimate is held against what renders really take: peak_rss of --stats.
TEST(MoteInfo, EstimatesTheMemoryOfARenderWithinAThird) {
  const TempFolder folder;
  writeBytes(folder.file("wall.obj"), "v -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\n");
  const std::string layers = R"("Z", "lights", "shadow", "velocity", "optical_depth")";
  const std::string solid = R"("solids": [{"file": "wall.obj"}],)";
  const std::pair<std::string, std::string> cases[] = {
      {"", ""}, {layers, ""}, {"", R"("medium": {"extinction": [1, 2, 3]},)"}, {"", solid}, {layers, solid}};
  for (const auto& [aovs, more] : cases) {
    // Small splats and no rays: memory is the same, and it takes no time.
    writeBytes(folder.file("s.json"), fmt::format(R"({{"particles": [{{"generate": "ball", "count": 400000}}], {}
                               "lights": [{{"name": "a", "shadow_density": 0}}, {{"name": "b", "shadow_density": 0}}],
                               "view": {{"radius_scale": 0.2}},
                               "output": {{"size": [1280, 720], "aovs": [{}], "compression": "none"}}}})",
                                                  more, aovs));
    const ProcessResult result = test::mote({"render", folder.file("s.json"), "--lighting", "cpu", "--raster", "cpu",
                                             "-o", folder.file("o.exr"), "--stats", folder.file("stats.json")},
                                            kWithoutVulkan);
    ASSERT_EQ(result.exitCode, 0) << result.err;
    const json stats = json::parse(readBytes(folder.file("stats.json")));
    const double measured = stats["frames"][0]["bytes"]["peak_rss"];
    const double estimated = infoOf(folder.file("s.json"))["estimate"]["host_bytes"];
    std::printf("%5.0f MB, estimated %5.0f MB: %s %s\n", measured / 1e6, estimated / 1e6, more.c_str(), aovs.c_str());
    EXPECT_LT(std::abs(estimated - measured), measured / 3) << more << " " << aovs;
  }
}
#endif

TEST(MoteInfo, DescribesThePartsOfAScene) {
  const TempFolder folder;
  for (const char* mesh : {"ground.01.obj", "pole.obj"})
    writeBytes(folder.file(mesh), "v -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\n");
  writeBytes(folder.file("s.json"), R"({"particles": [{"generate": "ball", "count": 1000}],
    "lights": [{"name": "a"}, {"name": "b", "type": "spot"}, {"name": "c", "type": "directional"}],
    "lighting": {"subsample": 0.25, "error": 0.01, "radius_scale": 2},
    "solids": [{"file": "ground.##.obj", "mode": "holdout"}, {"name": "pole", "file": "pole.obj", "casts_shadows": false}],
    "camera": {"type": "orthographic", "position": [0, 0, 5], "target": [0, 0, 1], "height": 3, "shutter": [0, 0.25],
               "aperture_radius": 0.5}})");
  const json info = infoOf(folder.file("s.json"));
  EXPECT_EQ(info["lights"][0]["type"], "point");
  EXPECT_EQ(info["lights"][1]["type"], "spot");
  EXPECT_EQ(info["lights"][2]["type"], "directional");
  EXPECT_EQ(info["solids"][0]["name"], "solid0");
  EXPECT_EQ(info["solids"][0]["file"], folder.file("ground.01.obj"));
  EXPECT_EQ(info["solids"][0]["mode"], "holdout");
  EXPECT_EQ(info["solids"][1]["casts_shadows"], false);
  EXPECT_EQ(info["lighting"], (json{{"subsample", 0.25}, {"compensate", true}, {"radius_scale", 2}, {"error", 0.01f}}));
  EXPECT_EQ(info["camera"], (json{{"type", "orthographic"},
                                  {"height", 3},
                                  {"fitted", false},
                                  {"keys", 0},
                                  {"shutter", {0, 0.25}},
                                  {"aperture_radius", 0.5},
                                  {"focus_distance", 4}}));
  const ProcessResult text = test::mote({"info", folder.file("s.json")});
  EXPECT_EQ(text.exitCode, 0) << text.err;
  for (const char* part : {"a (point), b (spot), c (directional)", "solid0: holdout, ", "pole: shaded, ",
                           "orthographic, height 3, shutter 0 to 0.25 s, aperture radius 0.5, sharp at 4",
                           "25 % of the particles in the octree, that stand for all; radii × 2\n"})
    EXPECT_TRUE(contains(text.out, part)) << text.out;
  EXPECT_FALSE(contains(text.out, "ΔT")) << "nobody measures the error of a fixed share";
}

TEST(MoteInfo, LeavesOpenWhatParticlesAndKeysDecide) {
  const TempFolder folder;
  writeBytes(folder.file("s.json"), R"({"particles": [{"generate": "ball", "count": 1000}],
    "lighting": {"subsample": "auto", "error": 0.01},
    "camera": {"type": "orthographic", "aperture_radius": 0.5, "keys": [{"frame": 1, "up": [0, 0, 1]}]}})");
  const json info = infoOf(folder.file("s.json"));
  EXPECT_EQ(info["camera"]["fitted"], true);
  EXPECT_EQ(info["camera"]["keys"], 1);
  EXPECT_TRUE(info["camera"]["height"].is_null());
  EXPECT_TRUE(info["camera"]["focus_distance"].is_null());
  EXPECT_EQ(info["lighting"]["subsample"], "auto");
  const ProcessResult text = test::mote({"info", folder.file("s.json")});
  for (const char* part : {"orthographic, fitted to the particles, 1 key, aperture radius 0.5, sharp at the target",
                           "the smallest share of the particles with a mean |ΔT| <= 0.01 in the octree"})
    EXPECT_TRUE(contains(text.out, part)) << text.out;
}

TEST(MoteInfo, NamesTheMissingParticleFileOfAScene) {
  const TempFolder folder;
  writeBytes(folder.file("s.json"), R"({"particles": [{"file": "gone.prt"}]})");
  const ProcessResult result = test::mote({"info", folder.file("s.json")});
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(contains(result.err, folder.file("gone.prt")));
}

TEST(MoteInfo, AFullStdoutIsExitCode3) {
  const TempFolder folder;
  const ProcessResult result = test::mote({"info", makeBall(folder)}, {.outputFile = "/dev/full"});
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_TRUE(contains(result.err, "stdout"));
}

}  // namespace
}  // namespace mote
