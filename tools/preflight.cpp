#include "tools/preflight.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/settling.h"
#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/timer.h"
#include "host/lighting/medium.h"
#include "host/scene/frame_path.h"
#include "host/scene/missing_file.h"
#include "host/scene/sequence.h"
#include "tools/info.h"
#include "tools/render.h"
#include "tools/scene_facts.h"

namespace mote {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A velocity of the wrong unit is off by the frame rate, or by metres to centimetres.
constexpr double kMostRadiiAFrame = 100;
constexpr double kThinnest = 1e-3, kThickest = 1e4;  ///< mean optical depths of lines through particles

bool isThere(const std::string& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

std::vector<int> framesOf(const Scene& scene) {
  std::vector<int> frames;
  for (int f = scene.frames.first; f <= scene.frames.last; f += scene.frames.step) frames.push_back(f);
  return frames;
}

/// All that is missing, not only the first of it.
std::vector<std::string> missingFiles(const Scene& scene) {
  std::vector<std::string> missing;
  const auto note = [&](const Scene& one) {
    try {
      checkSequences(one);
    } catch (const InputError& error) {
      missing.push_back(error.what());
    }
  };
  const auto noteFile = [&](const std::string& path, const char* what) {
    if (path.empty() || hasFramePattern(path) || isThere(path)) return;
    missing.push_back(InputError(path, "", what, "no such file", nearestNames(path, path)).what());
  };
  Scene one = scene;
  one.particles.clear(), one.solids.clear();
  for (const ParticleSource& source : scene.particles) {
    one.particles = {source};
    note(one);
    noteFile(source.file, "a particle file");
  }
  one.particles.clear();
  for (const Solid& solid : scene.solids) {
    one.solids = {solid};
    note(one);
    noteFile(solid.file, "a mesh");
  }
  noteFile(scene.view.spriteColor, "a picture for sprites");
  noteFile(scene.view.spriteOpacity, "a picture for sprites");
  return missing;
}

/// Bytes of a frame's particle files, for which frames are weighed against each other; at least 1.
double bytesOf(const Scene& scene, int frame) {
  double bytes = 1;
  for (const ParticleSource& source : scene.particles) {
    if (source.file.empty()) continue;
    std::error_code error;
    const auto size = fs::file_size(framePath(source.file, fileFrame(source.file, frame, scene.inputs.missing)), error);
    if (!error) bytes += static_cast<double>(size);
  }
  return bytes;
}

double meanLength(const std::vector<vec3>& vectors) {
  double sum = 0;
  for (const vec3& v : vectors) sum += static_cast<double>(glm::length(v));
  return vectors.empty() ? 0 : sum / static_cast<double>(vectors.size());
}

std::vector<std::string> suspicionsOf(const Scene& scene, const Frame& frame, const FrameStats& stats,
                                      std::size_t drawn) {
  std::vector<std::string> list;
  const ParticleSet& particles = frame.particles;
  const double radius = stats.radius.mean;
  if (const double step = meanLength(particles.velocity) / static_cast<double>(scene.frames.fps);
      radius > 0 && step > kMostRadiiAFrame * radius)
    list.push_back(
        fmt::format("velocities move particles by {:.0f} of their radii in a frame: are they per frame "
                    "(particles[].velocity_per), or in another unit (particles[].unit)?",
                    step / radius));
  const Bounds box = particles.bounds();
  if (const double diagonal = static_cast<double>(glm::length(box.hi - box.lo)); diagonal > 0 && radius > diagonal)
    list.push_back(
        fmt::format("the mean radius, {:.3g}, is greater than the box of all particles, {:.3g} from corner "
                    "to corner: is it in another unit?",
                    radius, diagonal));
  const vec3& extinction = frame.rules.extinction;
  const double depth = meanLineOpticalDepth(frame.density.tree(), frame.rules.falloff) *
                       static_cast<double>(extinction.x + extinction.y + extinction.z) / 3;
  if (stats.particles > 0 && depth < kThinnest)
    list.push_back(
        fmt::format("the mean optical depth through the particles is {:.2g}: too thin to be seen; "
                    "medium.optical_depth sets it instead of density_scale, {:.3g}",
                    depth, stats.densityScale));
  if (depth > kThickest)
    list.push_back(
        fmt::format("the mean optical depth through the particles is {:.2g}: nothing but their surface will "
                    "be lit; medium.optical_depth sets it instead of density_scale, {:.3g}",
                    depth, stats.densityScale));
  if (drawn == 0 && stats.particles > 0)
    list.push_back(fmt::format("the camera sees none of the {} particles in frame {}", stats.particles, frame.number));
  if (frame.lights.empty() && particles.emission.empty())
    list.push_back("there is no light, and no particle gives out any: the medium will be black");
  return list;
}

/// What the picture takes to write: of a thinned one, but compression goes by pixels first.
double writingSeconds(const Image& image, const Frame& frame, const Scene& scene, const RunStats& run,
                      const FrameStats& stats) {
  const fs::path path = fs::temp_directory_path() / fmt::format("mote-preflight-{}.exr", getpid());
  const Timer timer;
  writeFrameExr(path.string(), image, frame, scene, run, stats);
  const double seconds = timer.seconds();
  std::error_code ignored;
  fs::remove(path, ignored);
  return seconds;
}

struct Measured {
  std::map<std::string, double> seconds;  ///< stages of the frame, and "settling"
  std::vector<std::string> suspicions;
};

Measured measure(Scene scene, int number, const CommonOptions& common, RunStats& run) {
  std::unique_ptr<Gpu> gpu;
  const Backends backends = chooseBackends(scene.lighting.backend, scene.view.backend, deviceOptions(common), gpu);
  run = runOf(scene, backends, gpu.get());
  Renderer renderer(backends, gpu.get());
  Measured found;
  Timer timer;
  if (number != scene.wholeShot().first) settleByShot(scene);
  found.seconds["settling"] = timer.lap();
  FrameStats stats;
  const Frame frame = prepareFrame(scene, number, stats);
  found.seconds["load"] = stats.seconds["load"];
  found.seconds["octree"] = stats.seconds["octree"] + stats.seconds["solids"];
  found.seconds["lighting"] = renderer.lightingSeconds(frame);
  const DrawingSample drawing = renderer.drawingSample(frame, scene);
  found.seconds["draw"] = drawing.seconds;
  found.seconds["write"] = writingSeconds(drawing.picture, frame, scene, run, stats);
  found.suspicions = suspicionsOf(scene, frame, stats, drawing.inView);
  requireNoValidationMessages(gpu.get());
  return found;
}

/// `frames`: how many such frames the run is worth.
void addMeasured(const Scene& scene, int number, double frames, const CommonOptions& common, Json& found) {
  RunStats run;
  const Measured measured = measure(scene, number, common, run);
  found["suspicious"] = measured.suspicions;
  Json& estimate = found["estimate"];
  estimate["lighting"] = run.lighting, estimate["raster"] = run.raster, estimate["device"] = run.device;
  estimate["measured_frame"] = number;
  const auto second = [&](const char* stage) { return measured.seconds.at(stage); };
  const double work = second("octree") + second("lighting") + second("draw") + second("write");
  // Loading ahead takes a thread from the others.
  const double frame = work + second("load") / (loadsAhead(scene) ? threadCount() : 1);
  const auto rounded = [](double seconds) { return std::round(seconds * 1e4) / 1e4; };
  Json seconds = Json::object();
  for (const char* stage : {"load", "octree", "lighting", "draw", "write"}) seconds[stage] = rounded(second(stage));
  seconds["frame"] = rounded(frame);
  seconds["all"] = rounded(frame * frames + second("settling") + (loadsAhead(scene) ? second("load") : 0));
  estimate["seconds"] = std::move(seconds);
}

}  // namespace

Json preflight(const Scene& scene, const CommonOptions& common, bool measured) {
  const std::vector<std::string> missing = missingFiles(scene);
  if (!missing.empty()) return {{"file", scene.path}, {"kind", "scene"}, {"missing", missing}};
  const std::vector<int> frames = framesOf(scene);
  int largest = frames.front();
  double most = 0, all = 0;
  for (const int frame : frames) {
    const double bytes = bytesOf(scene, frame);
    if (bytes > most) most = bytes, largest = frame;
    all += bytes;
  }
  Json found = describeScene(scene, largest);
  found["missing"] = Json::array();
  if (measured) addMeasured(scene, largest, all / most, common, found);
  return found;
}

void printPreflight(const Json& found) {
  const auto row = [](const char* name, const std::string& text) { fmt::print("  {:<12} {}\n", name, text); };
  if (!found["missing"].empty()) {
    fmt::print("{}: scene\n", found["file"].get<std::string>());
    for (const Json& sentence : found["missing"]) row("missing", sentence.get<std::string>());
    return;
  }
  printScene(found);
  const Json& estimate = found["estimate"];
  const auto& frames = found["frames"];
  const int count = (frames["last"].get<int>() - frames["first"].get<int>()) / frames["step"].get<int>() + 1;
  if (!estimate.contains("seconds")) {
    row("work", fmt::format("{:.0f} rays a frame, {} threads", estimate["rays"].get<double>(),
                            estimate["threads"].get<unsigned>()));
    return;
  }
  row("work", fmt::format("{:.0f} rays a frame; lighting on the {}, picture on the {}, {} threads",
                          estimate["rays"].get<double>(), estimate["lighting"].get<std::string>(),
                          estimate["raster"].get<std::string>(), estimate["threads"].get<unsigned>()));
  const auto of = [&](const char* stage) { return estimate["seconds"][stage].get<double>(); };
  row("time", fmt::format("about {:.2g} s for frame {} (load {:.2g}, octree {:.2g}, lighting {:.2g}, draw {:.2g}, "
                          "write {:.2g}), {:.2g} s for {} {}",
                          of("frame"), estimate["measured_frame"].get<int>(), of("load"), of("octree"), of("lighting"),
                          of("draw"), of("write"), of("all"), count, count == 1 ? "frame" : "frames"));
  for (const Json& sentence : found["suspicious"]) row("suspicious", sentence.get<std::string>());
}

void requireNothingMissing(const Json& found) {
  const auto missing = found["missing"].get<std::vector<std::string>>();
  if (!missing.empty()) throw InputError(fmt::format("{}", fmt::join(missing, "\nmote: ")));
}

}  // namespace mote
