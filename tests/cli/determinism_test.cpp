// The same shot gives the same bytes: on every instruction set of this machine (MOTE_SIMD), on any number of threads,
// at any time, and on a device as often as one likes.
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/core/random.h"
#include "host/core/simd_targets.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/generate.h"
#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

using Json = nlohmann::json;

constexpr const char* kShot = R"({
  "particles": [{"file": "cloud.prt"}],
  "medium": {"optical_depth": 5},
  "lights": [
    {"name": "key", "type": "point", "position": [2, 3, 1], "intensity": 40},
    {"name": "rim", "type": "spot", "position": [-3, 3, -1], "target": [0, 0, 0], "intensity": 200, "inner_angle": 8, "outer_angle": 16},
    {"name": "sun", "type": "directional", "direction": [0.3, -1, -0.4], "irradiance": 3}
  ],
  "camera": {"position": [1, 1.5, 3.5], "target": [0, 0, 0], "fov": 35, "near": 0.1, "far": 50},
  "output": {"size": [93, 61], "aovs": ["Z"], "precision": "float"}
})";  // a width that no vector divides

struct Cloud {
  std::size_t count = 20'000;
  float radius = 0.05f;  ///< middle; the cloud is about two across
  float ratio = 10;      ///< of the greatest to the least
  bool colored = true;   ///< with every channel that there is
};

void writeCloud(const std::string& path, const Cloud& cloud) {
  ParticleSet set = generateParticles(Generator::Cloud, cloud.count, 3, 1);
  std::vector<vec3> absorption, emission;
  for (std::size_t i = 0; i < set.size(); ++i) {
    Random random(11, i);
    const auto share = [&] { return static_cast<float>(random.uniform()); };
    set.radius[i] = cloud.radius * std::pow(cloud.ratio, share() - 0.5f);
    if (!cloud.colored) continue;
    set.color.emplace_back(share(), share(), share());
    absorption.emplace_back(share(), 0.5f * share(), 0.1f * share());
    emission.push_back(i % 50 == 0 ? vec3(2, 0.6f, 0.1f) : vec3(0));
    set.velocity.emplace_back(8 * set.position[i].z, 1.0f, -8 * set.position[i].x);
  }
  std::vector<PrtColumn> columns = columnsOf(set);
  if (cloud.colored) {
    columns.push_back(PrtColumn::of("Absorption", std::span<const vec3>(absorption)));
    columns.push_back(PrtColumn::of("Emission", std::span<const vec3>(emission)));
  }
  writePrt(path, columns);
}

class Determinism : public testing::Test {
 protected:
  /// The picture's bytes; "" and a failure where there is none.
  std::string render(const std::vector<std::string>& more, const std::string& simd = "", unsigned threads = 0,
                     const char* where = "cpu") {
    const std::string picture = folder_.file("picture.exr");
    std::vector<std::string> arguments{
        "render",    folder_.file("shot.json"), "--lighting", where,   "--raster", where,
        "--threads", std::to_string(threads),   "-o",         picture, "--stats",  folder_.file("stats.json")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ProcessOptions options = kOnLavapipe;
    options.environment["LP_NATIVE_VECTOR_WIDTH"] = "256";
    options.environment["MOTE_SIMD"] = simd;
    const ProcessResult result = mote(arguments, options);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    if (result.exitCode != 0) return "";
    EXPECT_TRUE(simd.empty() || result.err.find(" threads, " + simd + ")") != std::string::npos) << result.err;
    return readBytes(picture);
  }

  /// Every instruction set, and 1, 2 and 7 threads on the best and on others.
  void expectTheSameBytesEverywhere(const std::vector<std::string>& more) {
    const std::vector<std::string> targets = simdTargets();
    const std::string best = render(more, targets[0], 2);
    ASSERT_FALSE(best.empty());
    std::vector<std::string> compared{targets[0] + " 2"};
    const auto expectBest = [&](const std::string& target, unsigned threads) {
      EXPECT_TRUE(render(more, target, threads) == best) << target << " on " << threads << " threads differs";
      compared.push_back(fmt::format("{} {}", target, threads));
    };
    expectBest(targets[0], 1);
    expectBest(targets[0], 7);
    constexpr unsigned kThreads[] = {7, 1, 2};
    for (std::size_t i = 1; i < targets.size(); ++i) expectBest(targets[i], kThreads[i % 3]);
    fmt::print("compared (instruction set, threads): {}\n", fmt::join(compared, ", "));
    EXPECT_GE(targets.size(), 2u) << "only one instruction set: nothing is compared";
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx2")) {  // else Highway was built without what the machine has
      EXPECT_NE(std::find(targets.begin(), targets.end(), "AVX2"), targets.end());
    }
#endif
  }

  /// How the lights were computed, one word each.
  std::vector<std::string> methods() const {
    const Json stats = Json::parse(readBytes(folder_.file("stats.json")));
    std::vector<std::string> words;
    for (const Json& light : stats["frames"][0]["light_error"]) words.push_back(light["method"]);
    return words;
  }

  void makeShot(const Cloud& cloud) {
    writeCloud(folder_.file("cloud.prt"), cloud);
    writeBytes(folder_.file("shot.json"), kShot);
  }

  TempFolder folder_;
};

const std::vector<std::string> kEverything{R"(--set=/camera/shutter=[-0.01,0.01])",  //
                                           "--set=/camera/aperture_radius=0.05",
                                           "--set=/camera/focus_distance=3.5",
                                           "--set=/lighting/subsample=0.5",
                                           R"(--set=/medium/phase={"type":"henyey_greenstein","g":0.4})",
                                           R"(--set=/output/aovs=["Z","lights","velocity","optical_depth","shadow"])"};

TEST_F(Determinism, OfThePlainPicture) {
  makeShot({.colored = false});
  expectTheSameBytesEverywhere({});
}

TEST_F(Determinism, OfColoursLensShutterSubsampleAndEveryLayer) {
  makeShot({});
  expectTheSameBytesEverywhere(kEverything);
}

// Approximations pay from some 80,000 particles on.
constexpr std::size_t kMany = 110'000;
/// Saves the calibration, which the shots above have.
const std::string kMedium = R"(--set=/medium={"density_scale":0.6})";
const std::string kOneLight = R"(--set=/lights=[{"name":"key","position":[2,3,1]}])";

TEST_F(Determinism, OfAGridOfLight) {
  for (const bool colored : {false, true}) {
    makeShot({.count = kMany, .colored = colored});
    expectTheSameBytesEverywhere({"--set=/lighting/error=0.01", kMedium, kOneLight});
    EXPECT_EQ(methods(), std::vector<std::string>{"light_grid"}) << colored;
  }
}

TEST_F(Determinism, OfLevelOfDetail) {
  makeShot({.count = kMany, .radius = 0.15f, .ratio = 1});
  expectTheSameBytesEverywhere({"--set=/lighting/error=0.0007", kMedium, kOneLight, "--set=/view/radius_scale=0.1"});
  EXPECT_EQ(methods(), std::vector<std::string>{"level_of_detail"});
}

TEST_F(Determinism, OfEveryMoment) {
  makeShot({});
  const auto begin = std::chrono::steady_clock::now();
  const std::string first = render(kEverything);
  do EXPECT_TRUE(render(kEverything) == first);
  while (std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(1100));  // a time stamp has moved on
}

TEST_F(Determinism, OfTheDevice) {
  for (const bool colored : {false, true}) {
    makeShot({.colored = colored});
    const std::vector<std::string> settings = colored ? kEverything : std::vector<std::string>{};
    EXPECT_TRUE(render(settings, "", 0, "gpu") == render(settings, "", 0, "gpu")) << colored;
  }
}

TEST_F(Determinism, AnInstructionSetThatIsNotThereIsWrongUsage) {
  makeShot({.count = 10});
  ProcessOptions options = kWithoutVulkan;
  options.environment["MOTE_SIMD"] = "MMX";
  const ProcessResult result = mote({"render", folder_.file("shot.json"), "-o", folder_.file("a.exr")}, options);
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_TRUE(
      contains(result.err, "mote: MOTE_SIMD: expected one of this machine's instruction sets: " + simdTargets()[0]));
  EXPECT_TRUE(contains(result.err, "got \"MMX\""));
}

}  // namespace
}  // namespace mote::test
