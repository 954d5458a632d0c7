// mote convert: particles of any format into PRT, PLY, CSV or NPY.
#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/conversion.h"
#include "host/scene/frame_path.h"
#include "host/scene/missing_file.h"
#include "tools/command.h"
#include "tools/conversion_report.h"
#include "tools/outputs.h"

namespace mote {
namespace {

namespace fs = std::filesystem;

struct ConvertOptions {
  std::vector<std::string> files;  ///< the last is the one to write
  std::vector<std::string> channels, types, rotate, translate;
  std::string frames, format, compression;
  double scale = 1, subsample = 1;
  std::uint64_t seed = 0;
  bool keepNames = false, text = false, json = false;
};

/// "1,2.5,-3"; CLI11 has parted it at the commas.
dvec3 parseVector(const char* flag, const std::vector<std::string>& parts) {
  dvec3 vector(0);
  std::string all;
  bool good = parts.size() == 3;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    double number = 0;
    const auto [end, error] = std::from_chars(parts[k].data(), parts[k].data() + parts[k].size(), number);
    good = good && error == std::errc() && end == parts[k].data() + parts[k].size() && std::isfinite(number);
    if (k < 3) vector[static_cast<int>(k)] = number;
    all += (k > 0 ? "," : "") + parts[k];
  }
  if (!parts.empty() && !good) throw InputError(flag, "", "three numbers, X,Y,Z", "\"" + all + "\"");
  return vector;
}

/// "OURS" or "OURS=THEIRS".
std::pair<std::string, std::string> parseChannel(const std::string& text) {
  const std::size_t equals = text.find('=');
  std::pair<std::string, std::string> names(text.substr(0, equals), "");
  if (equals != text.npos) names.second = text.substr(equals + 1);
  if (names.first.empty() || (equals != text.npos && names.second.empty()))
    throw InputError("--channels", "", "NAME, or NAME=ITS_NAME_IN_THE_FILE", "\"" + text + "\"");
  return names;
}

ConversionOptions parseOptions(const ConvertOptions& given, const std::string& output) {
  ConversionOptions options;
  if (given.format.empty()) {
    options.format = outputFormatOf(output);
  } else {
    const auto named = outputFormatNamed(given.format);
    if (!named) throw InputError("--format", "", "one of " + outputFormatNames(), "\"" + given.format + "\"");
    options.format = *named;
  }
  options.write = {.compression = given.compression, .text = given.text};
  for (const std::string& text : given.channels) {
    options.channels.push_back(parseChannel(text));
    for (std::size_t k = 0; k + 1 < options.channels.size(); ++k)
      if (options.channels[k].first == options.channels.back().first)
        throw InputError("--channels", "", "every channel once", "\"" + options.channels.back().first + "\" again");
  }
  for (const std::string& text : given.types) {
    const std::size_t equals = text.find('=');
    const auto type = equals == text.npos ? std::nullopt : numberNamed(text.substr(equals + 1));
    if (!type)
      throw InputError("--type", "",
                       "NAME=TYPE, a type being int8 to int64, uint8 to uint64, float16, float32 or float64",
                       "\"" + text + "\"");
    options.types[text.substr(0, equals)] = *type;
  }
  if (!(given.scale > 0) || !std::isfinite(given.scale))
    throw InputError("--scale", "", "a finite number > 0", fmt::format("{}", given.scale));
  options.subsample = static_cast<float>(given.subsample);
  if (!(options.subsample > 0 && options.subsample <= 1))
    throw InputError("--subsample", "", "a share, 0 < … ≤ 1", fmt::format("{}", given.subsample));
  options.keepNames = given.keepNames, options.seed = given.seed, options.scale = given.scale;
  options.rotate = parseVector("--rotate", given.rotate),
  options.translate = parseVector("--translate", given.translate);
  return options;
}

FrameRange framesOf(const ConvertOptions& options) {
  const bool several = !options.frames.empty();
  const std::string& output = options.files.back();
  const FrameRange frames = several ? parseFrameRange(options.frames) : FrameRange{};
  const auto wanted = [](const std::string& file) {
    return InputError(file, "", "--frames A-B, as the name has ####", "none");
  };
  for (const std::string& file : options.files)
    if (!several && hasFramePattern(file) && !fs::exists(file)) throw wanted(file);
  if (several && frames.first + frames.step <= frames.last && !hasFramePattern(output))
    throw InputError(output, "", "a name with #### for the frame number, because there are several frames",
                     "\"" + output + "\"", "for example plume.####.npy");
  return frames;
}

std::string pathIn(const ConvertOptions& options, const std::string& pattern, int frame) {
  return options.frames.empty() ? pattern : framePath(pattern, frame);
}

/// Everything that can be wrong with the names of files, before the first particle is read.
void checkFiles(const ConvertOptions& options, const FrameRange& frames) {
  std::string missing, firstMissing, itsPattern;
  std::size_t count = 0;
  std::vector<std::string> inputs;
  for (int frame = frames.first; frame <= frames.last; frame += frames.step)
    for (std::size_t k = 0; k + 1 < options.files.size(); ++k) {
      inputs.push_back(pathIn(options, options.files[k], frame));
      std::error_code ignored;
      if (fs::exists(inputs.back(), ignored)) continue;
      constexpr std::size_t kNamed = 10;
      if (count == 0) firstMissing = inputs.back(), itsPattern = options.files[k];
      if (++count <= kNamed) missing += (missing.empty() ? "" : ", ") + inputs.back();
    }
  if (count == 1)
    throw InputError(firstMissing, "", "a particle file", "no such file", nearestNames(itsPattern, firstMissing));
  if (count > 1)
    throw InputError(itsPattern, "", "all its frames",
                     fmt::format("{} files that do not exist: {}{}", count, missing, count > 10 ? " …" : ""));
  std::set<fs::path> places;
  for (const std::string& input : inputs) places.insert(fs::canonical(input));
  for (int frame = frames.first; frame <= frames.last; frame += frames.step) {
    const std::string output = pathIn(options, options.files.back(), frame);
    std::error_code ignored;
    if (const fs::path place = fs::canonical(output, ignored); places.contains(place))
      throw InputError(output, "", "a file that is none of the inputs", "one of them", "an input is never overwritten");
  }
  if (options.frames.empty())
    prepareOutput(options.files.back());
  else
    prepareOutputs(options.files.back(), frames.first);
}

void convert(const ConvertOptions& options) {
  if (options.files.size() < 2) throw InputError("mote convert", "", "one input or more, then the output", "one file");
  const ConversionOptions conversion = parseOptions(options, options.files.back());
  const FrameRange frames = framesOf(options);
  checkFiles(options, frames);
  for (int frame = frames.first; frame <= frames.last; frame += frames.step) {
    std::vector<std::unique_ptr<ParticleFile>> inputs;
    for (std::size_t k = 0; k + 1 < options.files.size(); ++k)
      inputs.push_back(openParticleFile(pathIn(options, options.files[k], frame)));
    const ConversionReport report = convertParticles(inputs, pathIn(options, options.files.back(), frame), conversion);
    if (options.json)  // one line a file
      fmt::print("{}\n", conversionJson(report).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    else
      printConversion(report);
  }
}

}  // namespace

void addConvertCommand(CLI::App& app, const CommonOptions&, int&) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* command = app.add_subcommand("convert", "Write particles of any format as PRT, PLY, CSV or NPY");
  command
      ->add_option("files", options->files,
                   "Particle files of any format, which are put one behind the other, then the file to write: "
                   ".prt, .ply, .csv or .npy; #### is the frame number")
      ->required()
      ->type_name("IN... OUT");
  command->add_option("--frames", options->frames, "Frames A-B, or A-BxS for every S-th: a file for each")
      ->type_name("A-B[xS]");
  command
      ->add_option("--channels", options->channels,
                   "Only these channels, in this order; NAME=OTHER writes the file's OTHER as NAME")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME,...");
  command->add_flag("--keep-names", options->keepNames,
                    "Leave channels their names (P, pscale, Coordinates) instead of giving them Mote's");
  command->add_option("--type", options->types, "Write a channel as another type: Density=float16")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME=TYPE,...");
  command
      ->add_option("--subsample", options->subsample,
                   "Write this share of the particles, chosen by a hash of ID, else of the index")
      ->type_name("SHARE");
  command->add_option("--seed", options->seed, "Of that choice; 0 by default")
      ->type_name("S")
      ->check([](const std::string& text) {  // CLI11 itself takes -1 for 2^64 - 1
        return text.find('-') == std::string::npos ? "" : "expected a whole number from 0 to 2^64 - 1, got " + text;
      });
  command->add_option("--scale", options->scale, "Multiply positions, radii and velocities")->type_name("S");
  command->add_option("--rotate", options->rotate, "Degrees about x, then y, then z")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("X,Y,Z");
  command->add_option("--translate", options->translate, "Then add this to positions")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("X,Y,Z");
  command->add_option("--format", options->format, "prt, prt2, ply, csv or npy, whatever the name ends in")
      ->type_name("FORMAT");
  command
      ->add_option("--compression", options->compression,
                   "Of PRT 2: uncompressed, zlib, lz4, transpose, transpose-zlib (default) or transpose-lz4")
      ->type_name("KIND");
  command->add_flag("--ascii", options->text, "PLY as text");
  command->add_flag("--json", options->json, "Print what was written, and what was lost, as one JSON object a file");
  command->callback([options] { convert(*options); });
}

}  // namespace mote
