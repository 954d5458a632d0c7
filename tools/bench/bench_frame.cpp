// mote bench frame: a noise cloud from PRT file to EXR picture, as mote render does it, on the CPU and on the device:
// 9 M particles with lighting.error 0.01 (thesis, figure 27), and 3 M with 100, 50 and 10 % of them in the octree
// (figures 30 and 31).
//
// The light of both runs that are timed must keep the error against exact light over all particles, for which the CPU
// renders once more; their pictures must equal each other by crosscheck's limits, as both take the same method at the
// same fineness. With sub-sampling both are exact.
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/core/timer.h"
#include "host/image/exr.h"
#include "host/particles/formats/prt_writer.h"
#include "host/particles/generate.h"
#include "tools/bench/bench_picture.h"
#include "tools/bench/scratch_file.h"
#include "tools/render.h"

namespace mote {
namespace {

constexpr ivec2 kSize(1920, 1080);
constexpr float kError = 0.01f;                                   // mean |ΔT|
constexpr double kMostCpuSeconds = 7.1, kMostDeviceSeconds = 15;  // floors; 7.1 s is the thesis' own, figure 27

/// A sub-sampled frame, and the seconds that the thesis has for it: figure 31, an eight-core i7 at 2.67 GHz.
struct Share {
  float share;
  double thesisSeconds;
};
constexpr Share kShares[] = {{1, 10.4}, {0.5f, 5.5}, {0.1f, 3.5}};

void writeCloud(const ScratchFile& file, std::uint64_t count) {
  writePrt(file.path(), columnsOf(generateParticles(Generator::Cloud, count, 0, 1)));
}

Scene fileScene(const ScratchFile& file, ivec2 size) { return benchScene({{"file", file.path()}}, size); }

/// From a scene's file to a picture's on one backend, and what that left.
class FileToFile {
 public:
  FileToFile(Scene scene, Backends backends, Gpu* gpu)
      : scene_(std::move(scene)), renderer_(backends, gpu), picture_("mote_bench_frame.exr") {
    run_.device = gpu ? gpu->device().name() : "none";
    run_.lighting = backends.gpuLighting ? "gpu" : "cpu";
    run_.raster = backends.gpuRaster ? "gpu" : "cpu";
    run_.threads = threadCount();
  }

  void render() {
    stats_ = {};
    Scene scene = scene_;
    const Frame frame = prepareFrame(scene, scene.frames.first, stats_);
    LightWanted wanted = lightWanted(scene);
    wanted.transmittance = keepsLight_;
    LitParticles lit = renderer_.light(frame, wanted, stats_);
    if (keepsLight_) transmittance_ = std::move(lit.transmittance.front());
    const Image image = renderer_.draw(frame, scene, std::move(lit), stats_);
    const Timer write;
    writeFrameExr(picture_.path(), image, frame, scene, run_, stats_);
    stats_.seconds["write"] = write.seconds();
    addDeviceClock(stats_);
  }

  Contender contender(const char* name, std::uint64_t count) {
    return {.name = name, .work = [this] { render(); }, .count = count, .stages = &stats_.seconds};
  }

  /// As it stands in the file.
  Image picture() const { return readExr(picture_.path()); }
  /// For runs that are not timed.
  void keepLight() { keepsLight_ = true; }
  /// The light of the last run, receiver by receiver; from here on it is not kept.
  std::vector<float> takeLight() {
    keepsLight_ = false;
    return std::move(transmittance_);
  }

 private:
  Scene scene_;
  Renderer renderer_;
  ScratchFile picture_;
  RunStats run_;
  FrameStats stats_;
  bool keepsLight_ = false;
  std::vector<float> transmittance_;
};

BenchCheck withinError(const std::vector<float>& found, const std::vector<float>& exact) {
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) sum += std::abs(double(found[i]) - double(exact[i]));
  const double mean = sum / static_cast<double>(found.size());
  return {fmt::format("mean |ΔT| {:.5f} over all particles (limit {})", mean, kError), mean <= double(kError)};
}

void largeCloud(Bench& bench) {
  const ScratchFile file("mote_bench_frame.prt");
  writeCloud(file, bench.count());
  const ivec2 size = scaledSize(kSize, static_cast<double>(bench.count()) / kFrameCount);
  Scene scene = fileScene(file, size);
  FileToFile exact(scene, {false, false}, nullptr);
  scene.lighting.error = kError;
  FileToFile host(scene, {false, false}, nullptr);
  exact.keepLight();
  host.keepLight();
  std::optional<FileToFile> device;
  if (bench.gpu()) device.emplace(scene, Backends{true, true}, bench.gpu()).keepLight();

  const auto check = [&] {
    exact.render();
    const std::vector<float> light = exact.takeLight();
    const Image picture = host.picture();
    const BenchCheck onHost = both(plausible(picture), withinError(host.takeLight(), light));
    if (!device) return onHost;
    return both(both(onHost, withinError(device->takeLight(), light)), samePicture(picture, device->picture()));
  };
  const Comparison* times =
      bench.compare(fmt::format("from file to picture, {} × {}, error {}", size.x, size.y, kError), "particles",
                    host.contender("CPU", bench.count()),
                    device ? std::optional(device->contender("device", bench.count())) : std::nullopt, check);
  if (!times) return;
  bench.addFloor({"from file to picture on the CPU [s]", times->medianA(), kMostCpuSeconds});
  if (device) bench.addFloor({"from file to picture on the device [s]", times->medianB(), kMostDeviceSeconds});
}

void subsampled(Bench& bench) {
  const std::uint64_t count = std::max<std::uint64_t>(2, bench.count() / 3);
  const ScratchFile file("mote_bench_frame.prt");
  writeCloud(file, count);
  const ivec2 size = scaledSize(kSize, static_cast<double>(bench.count()) / kFrameCount);
  std::vector<std::unique_ptr<FileToFile>> sides;
  std::vector<Trial> trials;
  for (const auto& [share, thesisSeconds] : kShares) {
    Scene scene = fileScene(file, size);
    scene.lighting.subsample = share;
    FileToFile& host = *sides.emplace_back(std::make_unique<FileToFile>(scene, Backends{false, false}, nullptr));
    Trial trial{.name = fmt::format("from file to picture, {} × {}, {:.0f} % in the octree (thesis, 3 M: {} s)", size.x,
                                    size.y, share * 100, thesisSeconds),
                .unit = "particles",
                .a = host.contender("CPU", count),
                .b = {},
                .check = [&host] { return plausible(host.picture()); }};
    if (bench.gpu()) {
      FileToFile& device = *sides.emplace_back(std::make_unique<FileToFile>(scene, Backends{true, true}, bench.gpu()));
      trial.b = device.contender("device", count);
      trial.check = [&host, &device] {
        const Image picture = host.picture();
        return both(plausible(picture), samePicture(picture, device.picture()));
      };
    }
    trials.push_back(std::move(trial));
  }
  bench.compareInTurn(trials);
}

}  // namespace

void benchFrame(Bench& bench) {
  largeCloud(bench);
  subsampled(bench);
}

}  // namespace mote
