// mote compare: how far two pictures are apart, and whether that is further than it may be.
#include "host/image/compare.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/core/output_file.h"
#include "host/image/exr.h"
#include "tools/command.h"

namespace mote {
namespace {

/// The limits by default are those that crosscheck holds CPU and GPU pictures to.
struct CompareOptions {
  std::string first, second, report, diff;
  CompareLimits limits;
};

void printDifference(const ImageDifference& d) {
  fmt::print("{} × {} pixels\n", d.width, d.height);
  fmt::print("{:<8}{:>12}{:>12}{:>12}   at\n", "", "RMSE", "mean", "max");
  const auto row = [](const std::string& name, const ChannelDifference& c) {
    fmt::print("{:<8}{:>12.3e}{:>12.3e}{:>12.3e}   {}, {}\n", name, c.rmse, c.mean, c.max, c.maxX, c.maxY);
  };
  const char* const names[] = {"R", "G", "B", "A"};
  for (int c = 0; c < 4; ++c) row(names[c], d.channel[c]);
  row("all", d.overall);
  for (const LayerDifference& layer : d.layers) {
    row(layer.name, layer.channel);
    if (layer.unmatched > 0) fmt::print("{:<8}{} pixels have it in one picture only\n", "", layer.unmatched);
  }
  fmt::print("PSNR {}, within 2/255: {:.4f} % of the pixels\n",
             std::isfinite(d.psnr) ? fmt::format("{:.1f} dB", d.psnr) : "infinite (no difference)", 100 * d.within);
}

std::string reportJson(const ImageDifference& difference, const CompareOptions& options,
                       const std::vector<std::string>& failed) {
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(differenceJson(difference));
  json["first"] = options.first, json["second"] = options.second;
  json["limits"] = {{"rmse", options.limits.rmse}, {"within", options.limits.within}};
  json["failures"] = failed;
  json["passed"] = failed.empty();
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void checkLimits(const CompareOptions& options) {
  const auto [rmse, within] = options.limits;
  if (!(rmse >= 0)) throw InputError("--max-rmse", "", "a number ≥ 0", fmt::format("{}", rmse));
  if (!(within >= 0 && within <= 1)) throw InputError("--within", "", "a share from 0 to 1", fmt::format("{}", within));
}

/// Returns whether the pictures are as alike as they must be.
bool compare(const CompareOptions& options) {
  checkLimits(options);
  for (const std::string& path : {options.report, options.diff})
    if (!path.empty()) const OutputFile probe(path);  // so that a bad name leaves nothing half done
  const Image first = readExr(options.first), second = readExr(options.second);
  if (first.width != second.width || first.height != second.height)
    throw InputError(options.second, "size", fmt::format("{} × {} as {}", first.width, first.height, options.first),
                     fmt::format("{} × {}", second.width, second.height));
  const ImageDifference difference = compareImages(first, second);
  const std::vector<std::string> failed = failuresOf(difference, options.limits);
  if (!options.diff.empty()) writeDifferencePng(options.diff, first, second);
  if (!options.report.empty()) writeWholeFile(options.report, reportJson(difference, options, failed));
  printDifference(difference);
  for (const std::string& failure : failed) fmt::print("differs: {}\n", failure);
  return failed.empty();
}

}  // namespace

void addCompareCommand(CLI::App& app, const CommonOptions&, int& exitCode) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command = app.add_subcommand(
      "compare", "Measure how far two pictures and their layers are apart; exit 1 where it is too far");
  command->add_option("first", options->first, "OpenEXR picture")->required()->type_name("A.exr");
  command->add_option("second", options->second, "OpenEXR picture of the same size")->required()->type_name("B.exr");
  command->add_option("--report", options->report, "Write the differences as JSON")->type_name("OUT.json");
  command->add_option("--diff", options->diff, "Write 64 × the difference as a picture")->type_name("OUT.png");
  command->add_option("--max-rmse", options->limits.rmse, "Greatest RMSE that passes; 1e-3, crosscheck's, by default")
      ->type_name("X");
  command
      ->add_option("--within", options->limits.within,
                   "Least share of pixels, in the picture and in each layer, that differ by at most 2/255; 0.999, "
                   "crosscheck's, by default")
      ->type_name("SHARE");
  command->callback([options, &exitCode] { exitCode = compare(*options) ? 0 : 1; });
}

}  // namespace mote
