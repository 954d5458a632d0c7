// Seconds of runs in turn, and their ratios.
#pragma once
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace mote {

/// Runs of one contender.
struct RunTimes {
  std::vector<double> wall;  ///< seconds
  std::vector<double> core;  ///< CPU seconds of the process over all threads: what others' load disturbs least
  std::map<std::string, std::vector<double>> stages{};  ///< wall-clock seconds of its parts, where it has any

  void time(const std::function<void()>& work);
};

double median(std::vector<double> values);

/// b / a in wall-clock seconds, run by run.
std::vector<double> pairwiseRatios(const RunTimes& b, const RunTimes& a);

/// Sets ratio_median, ratio_min and ratio_max of a run in a report; null where there are none.
void setRatios(nlohmann::ordered_json& run, const std::vector<double>& ratios);

}  // namespace mote
