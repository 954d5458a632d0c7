#include "tools/bench/timing.h"

#include <algorithm>
#include <ctime>

#include "host/core/error.h"
#include "host/core/timer.h"

namespace mote {

void RunTimes::time(const std::function<void()>& work) {
  const std::clock_t start = std::clock();
  const Timer timer;
  work();
  wall.push_back(timer.seconds());
  core.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
}

double median(std::vector<double> values) {
  MOTE_CHECK(values.size(), >, 0u);
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

std::vector<double> pairwiseRatios(const RunTimes& b, const RunTimes& a) {
  std::vector<double> ratios;
  for (std::size_t run = 0; run < b.wall.size(); ++run) ratios.push_back(b.wall[run] / a.wall[run]);
  return ratios;
}

void setRatios(nlohmann::ordered_json& run, const std::vector<double>& ratios) {
  run["ratio_median"] = run["ratio_min"] = run["ratio_max"] = nullptr;
  if (ratios.empty()) return;
  const auto [least, greatest] = std::minmax_element(ratios.begin(), ratios.end());
  run["ratio_median"] = median(ratios);
  run["ratio_min"] = *least;
  run["ratio_max"] = *greatest;
}

}  // namespace mote
