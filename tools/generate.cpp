// mote generate: particles made by Mote itself, as PRT files.
#include "host/particles/generate.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/core/timer.h"
#include "host/particles/formats/prt_writer.h"
#include "host/scene/frame_path.h"
#include "tools/command.h"
#include "tools/outputs.h"

namespace mote {
namespace {

constexpr double kMaxCount = 4e9;  // as in scenes: particles are numbered with 32 bits

struct GenerateOptions {
  std::string kind, count, frames = "1", output;
  std::uint64_t seed = 0;
};

/// The factor that a letter behind a number stands for; 0 for none that is known.
double factorOf(std::string_view suffix) {
  if (suffix.empty()) return 1;
  if (suffix == "k" || suffix == "K") return 1e3;
  if (suffix == "M" || suffix == "m") return 1e6;
  if (suffix == "G" || suffix == "g") return 1e9;
  return 0;
}

/// 350000, 9e6, 9M, 350k, 1.5M.
std::uint64_t parseCount(const std::string& text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const double count =
      number * factorOf(std::string_view(end, static_cast<std::size_t>(text.data() + text.size() - end)));
  // 1.1M is 1100000.0000000002 in double; what is meant is the whole number beside it.
  const double whole = std::round(count);
  const bool isWhole = std::abs(count - whole) <= 1e-9 * whole;
  if (error != std::errc{} || !isWhole || !(whole >= 1) || !(whole <= kMaxCount))
    throw InputError("--count", "", "a whole number of particles from 1 to 4000000000", "\"" + text + "\"",
                     "for example 350000, 350k, 9M or 9e6");
  return static_cast<std::uint64_t>(whole);
}

/// Everything that can be wrong with the outputs, before the first particle is made.
void checkOutput(const std::string& pattern, const FrameRange& frames) {
  if (std::filesystem::path(pattern).extension() != ".prt")
    throw InputError("--output", "", "a name that ends in .prt", "\"" + pattern + "\"",
                     "generate writes PRT files only");
  if (frames.first + frames.step <= frames.last && !hasFramePattern(pattern))
    throw InputError("--output", "", "a name with #### for the frame number, because there are several frames",
                     "\"" + pattern + "\"", "for example plume.####.prt");
  prepareOutputs(pattern, frames.first);
}

std::string uint32Bytes(std::initializer_list<std::uint32_t> values) {
  std::string bytes;
  for (const std::uint32_t value : values) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes;
}

/// PRT's own standard values, and what made the file: nothing that differs between two runs.
std::vector<Metadata> metadataOf(const GenerateOptions& options, std::uint64_t count, int frame) {
  constexpr std::int32_t kRightHandedYUp = 1, kPoint = 1, kVector = 2, kScalar = 6;
  return {Metadata::int32("", "CoordSys", kRightHandedYUp),
          {"", "FrameRate", static_cast<std::int32_t>(NumberType::U32),
           uint32Bytes({static_cast<std::uint32_t>(kGeneratorFps), 1})},
          Metadata::text("", "Generator",
                         fmt::format("mote {} generate {} --count {} --seed {} --frames {}", MOTE_VERSION, options.kind,
                                     count, options.seed, frame)),
          Metadata::text("", "GeneratorSeed", fmt::format("{}", options.seed)),
          Metadata::int32("Position", "Interpretation", kPoint),
          Metadata::int32("Velocity", "Interpretation", kVector),
          Metadata::int32("Radius", "Interpretation", kScalar)};
}

void generate(const GenerateOptions& options) {
  const std::uint64_t count = parseCount(options.count);
  const FrameRange frames = parseFrameRange(options.frames);
  checkOutput(options.output, frames);
  const Generator kind = generatorNamed(options.kind);
  for (int frame = frames.first; frame <= frames.last; frame += frames.step) {
    const Timer timer;
    const std::string path = framePath(options.output, frame);
    const ParticleSet set = generateParticles(kind, count, options.seed, frame);
    writePrt(path, columnsOf(set), metadataOf(options, count, frame));
    logInfo(fmt::format("{}: {} particles, {:.1f} MB, {:.1f} s", path, set.size(),
                        static_cast<double>(std::filesystem::file_size(path)) / 1e6, timer.seconds()));
  }
}

}  // namespace

void addGenerateCommand(CLI::App& app, const CommonOptions&, int&) {
  auto options = std::make_shared<GenerateOptions>();
  CLI::App* command = app.add_subcommand("generate", "Make particles: a cloud, a smoke plume or a uniform ball");
  command->add_option("kind", options->kind, "cloud, plume or ball")
      ->required()
      ->type_name("KIND")
      ->check(CLI::IsMember({"cloud", "plume", "ball"}).description(""));
  command->add_option("--count", options->count, "Number of particles: 350000, 350k, 9M or 9e6")
      ->required()
      ->type_name("N");
  command->add_option("--seed", options->seed, "Same seed, same particles; 0 by default")
      ->type_name("S")
      ->check([](const std::string& text) {  // CLI11 itself takes -1 for 2^64 - 1
        return text.find('-') == std::string::npos ? "" : "expected a whole number from 0 to 2^64 - 1, got " + text;
      });
  command->add_option("--frames", options->frames, "Frames A-B, or A-BxS for every S-th; 1 by default")
      ->type_name("A-B[xS]");
  command->add_option("-o,--output", options->output, "PRT file to write; #### is the frame number")
      ->required()
      ->type_name("OUT.prt");
  command->callback([options] { generate(*options); });
}

}  // namespace mote
