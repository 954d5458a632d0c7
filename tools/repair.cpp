// mote repair: the particles of a PRT file that was not closed, or whose data are cut off or damaged.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/particles/conversion.h"
#include "host/particles/formats/salvage.h"
#include "host/scene/missing_file.h"
#include "tools/command.h"
#include "tools/conversion_report.h"

namespace mote {
namespace {

namespace fs = std::filesystem;

struct RepairOptions {
  std::string input, output;
  bool json = false;
};

/// "all 12 particles are there" or "saved 5 of 12 particles: the file ends within particle 5".
std::string outcome(const Salvaged& salvaged) {
  const std::uint64_t saved = salvaged.file->count();
  const WhatIsWrong& wrong = salvaged.wrong;
  if (wrong.sentence.empty()) return fmt::format("nothing is wrong with it, all {} particles are there", saved);
  if (!wrong.promised)
    return fmt::format("saved {} particles, of how many was never written: {}", saved, wrong.sentence);
  return fmt::format("saved {} of {} particles: {}", saved, *wrong.promised, wrong.sentence);
}

void repair(const RepairOptions& options) {
  std::error_code ignored;
  if (!fs::exists(options.input, ignored))
    throw InputError(options.input, "", "a PRT file", "no such file", nearestNames(options.input, options.input));
  if (fs::equivalent(options.input, options.output, ignored))
    throw InputError(options.output, "", "a file that is not the input", "the input", "it is never overwritten");
  ConversionOptions conversion;
  conversion.format = outputFormatOf(options.output);
  conversion.keepNames = true;
  Salvaged salvaged = salvageParticles(options.input);
  // What is repaired stays what it is: .prt is the name of both.
  if (conversion.format == OutputFormat::Prt1 && !salvaged.file->format().starts_with("PRT 1."))
    conversion.format = OutputFormat::Prt2;
  if (salvaged.file->count() == 0 && !salvaged.wrong.sentence.empty())
    throw InputError(fmt::format("{}: not one whole particle is there ({}); there is nothing to save", options.input,
                                 salvaged.wrong.sentence));
  const std::string text = outcome(salvaged);
  const std::vector<std::unique_ptr<ParticleFile>> inputs = [&] {
    std::vector<std::unique_ptr<ParticleFile>> one;
    one.push_back(std::move(salvaged.file));
    return one;
  }();
  const ConversionReport report = convertParticles(inputs, options.output, conversion);
  if (!options.json) {
    fmt::print("{}: {}\n", options.input, text);
    printConversion(report);
    return;
  }
  nlohmann::ordered_json json = {
      {"input", options.input}, {"saved", report.written}, {"promised", nullptr}, {"wrong", salvaged.wrong.sentence}};
  if (salvaged.wrong.promised) json["promised"] = *salvaged.wrong.promised;
  json["output"] = conversionJson(report);
  fmt::print("{}\n", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace

void addRepairCommand(CLI::App& app, const CommonOptions&, int&) {
  auto options = std::make_shared<RepairOptions>();
  CLI::App* command =
      app.add_subcommand("repair", "Save the particles of a PRT file that was not closed, is cut off or damaged");
  command->add_option("input", options->input, "PRT file")->required()->type_name("IN.prt");
  command->add_option("output", options->output, "File to write: .prt, .ply, .csv or .npy")
      ->required()
      ->type_name("OUT");
  command->add_flag("--json", options->json, "Print what was saved as a JSON object");
  command->callback([options] { repair(*options); });
}

}  // namespace mote
