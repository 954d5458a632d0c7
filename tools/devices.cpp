// mote devices: the Vulkan devices of this machine, and what each lacks for Mote.
#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/vulkan/instance.h"
#include "engine/vulkan/physical_device.h"
#include "host/core/error.h"
#include "tools/command.h"

namespace mote {
namespace {

void printText(const std::vector<DeviceReport>& reports) {
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const DeviceReport& r = reports[i];
    fmt::print("{}  {}\n", i, r.name);
    fmt::print("   type    {}\n   Vulkan  {}\n   driver  {}\n   memory  {:.1f} GiB\n", r.type, r.apiVersion, r.driver,
               static_cast<double>(r.memory) / 0x1p30);
    fmt::print("   Mote    {}\n", r.missing.empty() ? "has all it needs" : "cannot use it; it lacks:");
    for (const std::string& missing : r.missing) fmt::print("             {}\n", missing);
  }
}

void printJson(const std::vector<DeviceReport>& reports) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const DeviceReport& r = reports[i];
    list.push_back({{"number", i},
                    {"name", r.name},
                    {"type", r.type},
                    {"vulkan", r.apiVersion},
                    {"driver", r.driver},
                    {"memory", r.memory},
                    {"usable", r.missing.empty()},
                    {"missing", r.missing}});
  }
  fmt::print("{}\n", list.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void devices(bool json, const CommonOptions& common) {
  const Instance instance(common.validate);
  const std::vector<DeviceReport> reports = listDevices(instance, testSetting("MOTE_LIMITS"));
  if (reports.empty())
    throw MachineError("no Vulkan device; install mesa-vulkan-drivers, or work without: --lighting cpu --raster cpu");
  json ? printJson(reports) : printText(reports);
  const std::vector<std::string> messages = instance.validationMessages();
  if (!messages.empty())
    throw MachineError(fmt::format("the Vulkan validation layers report {} messages:\n  {}", messages.size(),
                                   fmt::join(messages, "\n  ")));
}

}  // namespace

void addDevicesCommand(CLI::App& app, const CommonOptions& common, int&) {
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("devices", "List the Vulkan devices, and for each what Mote lacks there");
  command->add_flag("--json", *json, "Print an array of objects");
  command->callback([json, &common] { devices(*json, common); });
}

}  // namespace mote
