// mote bench figures: the measurements of the thesis (Monette 2011, section 5.1 and figure 31) with Mote: seconds of a
// frame's stages against particles (figure 22), lights (23), picture size (24), particles per cell (25) and the share
// of the particles in the octree (31), on the CPU and on the device.
//
// The thesis' text gives what is held (250,000 particles in 23 and 24, a million in 25, three million in 31; one light
// but in 23) and the shares of 31. What the other figures' axes hold stands only in its pictures; the values below
// are ours.
#include <glm/gtc/constants.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/renderer.h"
#include "tools/bench/bench_picture.h"

namespace mote {
namespace {

constexpr std::uint64_t kParticles[] = {125'000, 250'000, 500'000, 1'000'000, 2'000'000, kFiguresCount};
constexpr int kLights[] = {1, 2, 4, 8, 16};
constexpr ivec2 kSizes[] = {{640, 360}, {960, 540}, {1280, 720}, {1920, 1080}, {2560, 1440}, {3840, 2160}};
constexpr std::uint32_t kCells[] = {10, 25, 50, 100, 250, 500, 1000};  // 50: the thesis' rule for a million
constexpr float kShares[] = {1, 0.5f, 0.1f};
constexpr ivec2 kSize(1280, 720);  // where it does not vary: a scene's default

/// Particles in memory, and the scene with what its first frame settles (density scale, camera): what is timed is a
/// frame of a sequence, not the calibration.
struct Cloud {
  FrameFiles files;
  Scene scene;

  std::uint64_t count() const { return files.particles.size(); }
};

Cloud makeCloud(std::uint64_t count, ivec2 size) {
  Scene scene = benchScene(benchCloudSource(count), size);
  FrameFiles files = loadFrame(scene, scene.frames.first, FramePurpose::Picture);
  FrameStats stats;
  prepareFrame(scene, FrameFiles(files), stats);
  return {std::move(files), std::move(scene)};
}

/// One backend, and what its last frame left.
class Side {
 public:
  Side(Backends backends, Gpu* gpu) : renderer_(backends, gpu) {}

  /// Draws the cloud as `scene`, which must outlive it, has it.
  Contender contender(const char* name, const Cloud& cloud, const Scene& scene) {
    return {.name = name,
            .work = [this, &scene] { draw(scene); },
            .prepare =
                [this, &cloud] {
                  files_ = cloud.files;
                  image_ = {};
                },
            .count = cloud.count(),
            .stages = &stats_.seconds};
  }
  const Image& image() const { return image_; }

 private:
  void draw(Scene scene) {
    stats_ = {};
    const Frame frame = prepareFrame(scene, std::move(files_), stats_);
    image_ = renderer_.draw(frame, scene, renderer_.light(frame, lightWanted(scene), stats_), stats_);
    stats_.seconds.erase("load");  // once, for all runs
    addDeviceClock(stats_);
  }

  Renderer renderer_;
  FrameFiles files_;
  FrameStats stats_;
  Image image_;
};

/// A figure's points, all of which differ from their cloud's scene in one thing.
struct Figure {
  int number;
  std::string title, axis;
  struct Point {
    std::string name;
    double x;
    const Cloud* cloud;
    Scene scene;
  };
  std::vector<Point> points{};

  /// The scene of one more point, to be changed.
  Scene& add(std::string name, double x, const Cloud& cloud) {
    return points.emplace_back(std::move(name), x, &cloud, cloud.scene).scene;
  }
};

void measure(Bench& bench, const Figure& figure) {
  Side host({false, false}, nullptr), device({bench.gpu() != nullptr, bench.gpu() != nullptr}, bench.gpu());
  std::vector<Trial> trials;
  for (const Figure::Point& point : figure.points) {
    Trial trial{.name = fmt::format("figure {}, {}", figure.number, point.name),
                .unit = "particles",
                .a = host.contender("CPU", *point.cloud, point.scene),
                .b = {},
                .check = [&] { return plausible(host.image()); },
                .point = FigurePoint{figure.number, figure.title, figure.axis, point.x}};
    if (bench.gpu()) {
      trial.b = device.contender("device", *point.cloud, point.scene);
      trial.check = [&] { return both(plausible(host.image()), samePicture(host.image(), device.image())); };
    }
    trials.push_back(std::move(trial));
  }
  bench.compareInTurn(trials);
}

/// What is left of the thesis' numbers at the size that was asked for.
class Sizes {
 public:
  explicit Sizes(std::uint64_t largest) : share_(static_cast<double>(largest) / kFiguresCount) {}

  std::uint64_t particles(std::uint64_t full) const {
    return std::max<std::uint64_t>(2, std::llround(static_cast<double>(full) * share_));
  }
  ivec2 picture(ivec2 full) const { return scaledSize(full, share_); }
  Cloud cloud(std::uint64_t full) const { return makeCloud(particles(full), picture(kSize)); }

 private:
  double share_;
};

void againstParticles(Bench& bench, const Sizes& sizes) {
  std::vector<Cloud> clouds;
  for (const std::uint64_t count : kParticles) clouds.push_back(sizes.cloud(count));
  Figure figure{22, "one light", "particles"};
  for (const Cloud& cloud : clouds)
    figure.add(fmt::format("{} particles", cloud.count()), static_cast<double>(cloud.count()), cloud);
  measure(bench, figure);
}

/// `count` lights around the cloud, of one light's power in all, so that pictures stay as bright.
std::vector<LightSource> lightRing(const LightSource& light, int count) {
  std::vector<LightSource> ring;
  for (int i = 0; i < count; ++i) {
    const float angle = 2 * glm::pi<float>() * static_cast<float>(i) / static_cast<float>(count);
    LightSource next = light;
    next.name = fmt::format("light{}", i);
    next.position.x = light.position.x * std::cos(angle) + light.position.z * std::sin(angle);
    next.position.z = light.position.z * std::cos(angle) - light.position.x * std::sin(angle);
    next.strength = light.strength / static_cast<float>(count);
    ring.push_back(next);
  }
  return ring;
}

void againstLightsAndSize(Bench& bench, const Sizes& sizes) {
  const Cloud cloud = sizes.cloud(250'000);
  const std::string held = fmt::format("{} particles", cloud.count());
  Figure lights{23, held, "lights"};
  for (const int count : kLights)
    lights.add(fmt::format("{} lights", count), count, cloud).lights = lightRing(cloud.scene.lights.front(), count);
  measure(bench, lights);

  Figure pictures{24, held + ", one light", "pixels"};
  for (const ivec2& full : kSizes) {
    const ivec2 size = sizes.picture(full);
    pictures.add(fmt::format("{} × {}", size.x, size.y), double(size.x) * size.y, cloud).output.size = size;
  }
  measure(bench, pictures);
}

void againstCells(Bench& bench, const Sizes& sizes) {
  const Cloud cloud = sizes.cloud(1'000'000);
  Figure figure{25, fmt::format("{} particles, one light", cloud.count()), "particles per cell"};
  for (const std::uint32_t cell : kCells)
    figure.add(fmt::format("{} particles per cell", cell), cell, cloud).lighting.particlesPerCell = cell;
  measure(bench, figure);
}

void againstShare(Bench& bench, const Sizes& sizes) {
  const Cloud cloud = sizes.cloud(3'000'000);
  Figure figure{31, fmt::format("{} particles, one light", cloud.count()), "particles in the octree [%]"};
  for (const float share : kShares) {
    const double percent = std::round(double(share) * 100);
    figure.add(fmt::format("{} % in the octree", percent), percent, cloud).lighting.subsample = share;
  }
  measure(bench, figure);
}

}  // namespace

void benchFigures(Bench& bench) {
  const Sizes sizes(bench.count());
  againstParticles(bench, sizes);
  againstLightsAndSize(bench, sizes);
  againstCells(bench, sizes);
  againstShare(bench, sizes);
}

}  // namespace mote
