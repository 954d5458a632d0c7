#include "engine/stats.h"

#include <sys/resource.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace mote {
namespace {

using Json = nlohmann::ordered_json;

const char* nameOf(DepthMethod method) {
  switch (method) {
    case DepthMethod::Grid: return "light_grid";
    case DepthMethod::Detail: return "level_of_detail";
    case DepthMethod::Exact: break;
  }
  return "exact";
}

Json toJson(const LightMethod& method) {
  const Approximation& how = method.how;
  Json json = {{"light", method.light}, {"method", nameOf(how.method)}, {"allowed", how.allowed}};
  if (how.method == DepthMethod::Grid) {
    json["cell"] = how.resolution.cell;
    json["bin"] = how.resolution.bin;
    json["cell_radii"] = how.cellRadii;
  }
  if (how.method == DepthMethod::Detail) {
    json["tolerance"] = how.tolerance;
    json["tree_particles"] = how.treeParticles;
  }
  json["mean"] = how.error.mean;
  json["upper"] = how.error.upper;
  json["p99"] = how.error.p99;
  json["max"] = how.error.greatest;
  json["probes"] = how.error.probes;
  return json;
}

Json reproducible(const FrameStats& frame) {
  Json methods = Json::array();
  for (const LightMethod& method : frame.methods) methods.push_back(toJson(method));
  Json inputs = Json::array();
  for (const FrameInput& input : frame.inputs) inputs.push_back({{"file", input.file}, {"sha256", input.sha256}});
  return {
      {"frame", frame.frame},
      {"lighting", frame.lighting},
      {"raster", frame.raster},
      {"settled_by", frame.settledBy ? Json(*frame.settledBy) : Json(nullptr)},
      {"particles", frame.particles},
      {"in_octree", frame.inOctree},
      {"drawn", frame.drawn},
      {"lights", frame.lights},
      {"density_scale", frame.densityScale},
      {"subsample",
       {{"fraction", frame.subsample}, {"error", frame.subsampleError ? Json(*frame.subsampleError) : Json(nullptr)}}},
      {"light_error", std::move(methods)},
      {"radius", {{"min", frame.radius.min}, {"mean", frame.radius.mean}, {"max", frame.radius.max}}},
      {"origin", {frame.origin.x, frame.origin.y, frame.origin.z}},
      {"inputs", std::move(inputs)},
      {"warnings", frame.warnings}};
}

Json rounded(const std::map<std::string, double>& seconds) {
  Json object = Json::object();
  for (const auto& [stage, value] : seconds) object[stage] = std::round(value * 1e6) / 1e6;
  return object;
}

}  // namespace

std::uint64_t peakResidentBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::string statsJson(const RunStats& run) {
  Json frames = Json::array();
  for (const FrameStats& frame : run.frames) {
    Json entry = reproducible(frame);
    entry["seconds"] = rounded(frame.seconds);
    entry["device_seconds"] = rounded(frame.deviceSeconds);
    entry["bytes"] = {{"peak_rss", peakResidentBytes()}, {"device", frame.deviceBytes}};
    frames.push_back(std::move(entry));
  }
  Json failed = Json::array();
  for (const FailedFrame& frame : run.failed) failed.push_back({{"frame", frame.frame}, {"error", frame.error}});
  const Json root = {{"version", MOTE_VERSION},     {"device", run.device},   {"lighting", run.lighting},
                     {"raster", run.raster},        {"threads", run.threads}, {"frames", std::move(frames)},
                     {"failed", std::move(failed)}, {"skipped", run.skipped}};
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string reproducibleStatsJson(const FrameStats& frame) {
  Json root = reproducible(frame);
  root["version"] = MOTE_VERSION;
  return root.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace mote
