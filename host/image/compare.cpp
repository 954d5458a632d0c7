#include "host/image/compare.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/core/error.h"
#include "host/image/channels.h"
#include "host/image/png.h"

namespace mote {
namespace {

void checkSizes(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height)
    throw InputError("second picture", "size", fmt::format("{} × {}, as the first", a.width, a.height),
                     fmt::format("{} × {}", b.width, b.height));
}

/// Sums of one channel, or of all four.
struct Sums {
  double squares = 0, absolutes = 0;
  std::size_t count = 0;
  ChannelDifference result;

  void add(double difference, int x, int y) {
    squares += difference * difference, absolutes += difference, ++count;
    if (difference > result.max) result.max = difference, result.maxX = x, result.maxY = y;
  }
  ChannelDifference finish() {
    if (count > 0) result.rmse = std::sqrt(squares / count), result.mean = absolutes / count;
    return result;
  }
};

/// Greatest finite number of either channel, by its size.
double greatest(const ChannelView& a, const ChannelView& b, std::size_t pixels) {
  double result = 0;
  for (const ChannelView* view : {&a, &b})
    for (std::size_t i = 0; i < pixels; ++i) {
      const float value = view->at(i);
      if (std::isfinite(value) && (view->empty == 0 || value != view->empty))
        result = std::max(result, std::fabs(double(value)));
    }
  return result;
}

LayerDifference compareLayer(const ChannelView& a, const ChannelView& b, int width, std::size_t pixels) {
  LayerDifference layer{.name = a.name};
  layer.scale = std::clamp(greatest(a, b, pixels), kLeastLayerScale, 1.0);
  Sums sums;
  std::size_t within = 0;
  double level = 0;
  std::size_t held = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float p = a.at(i), q = b.at(i);
    if (a.empty != 0 && (p == a.empty) != (q == a.empty)) {
      ++layer.unmatched;
      continue;
    }
    const double difference = std::fabs(double(p) - double(q));  // ∞ and ∞ do not compare either
    if (!std::isfinite(difference)) {
      ++sums.result.notFinite;
      continue;
    }
    sums.add(difference, static_cast<int>(i % static_cast<std::size_t>(width)),
             static_cast<int>(i / static_cast<std::size_t>(width)));
    if (a.empty == 0 || p != a.empty) level += std::fabs(double(p)), ++held;
    within += difference <= kPixelTolerance * std::max(layer.scale, std::fabs(double(p)));
  }
  layer.channel = sums.finish();
  if (held > 0) layer.level = level / static_cast<double>(held);
  if (pixels > 0) layer.within = double(within) / double(pixels);
  return layer;
}

void compareLayers(const Image& a, const Image& b, ImageDifference& out) {
  const std::vector<ChannelView> first = channelsOf(a), second = channelsOf(b);
  const auto find = [](const std::vector<ChannelView>& in, const std::string& name) {
    return std::find_if(in.begin(), in.end(), [&](const ChannelView& view) { return view.name == name; });
  };
  for (std::size_t c = 4; c < first.size(); ++c) {  // R G B A come first
    const auto twin = find(second, first[c].name);
    if (twin == second.end())
      out.onlyInFirst.push_back(first[c].name);
    else
      out.layers.push_back(compareLayer(first[c], *twin, a.width, a.pixels.size()));
  }
  for (const ChannelView& view : second)
    if (find(first, view.name) == first.end()) out.onlyInSecond.push_back(view.name);
}

nlohmann::json jsonOf(const ChannelDifference& c) {
  return {
      {"rmse", c.rmse}, {"mean", c.mean}, {"max", c.max}, {"max_at", {c.maxX, c.maxY}}, {"not_finite", c.notFinite}};
}

}  // namespace

ImageDifference compareImages(const Image& a, const Image& b) {
  checkSizes(a, b);
  Sums channel[4], all;
  std::size_t within = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const vec4 &p = a.at(x, y), &q = b.at(x, y);
      bool finite = true, near = true;
      double difference[4];
      for (int c = 0; c < 4; ++c) {
        difference[c] = std::fabs(double(p[c]) - double(q[c]));
        if (!std::isfinite(difference[c])) finite = false, ++channel[c].result.notFinite;
        near = near && difference[c] <= kPixelTolerance;
      }
      if (!finite) {
        ++all.result.notFinite;
        continue;
      }
      within += near;
      for (int c = 0; c < 4; ++c) channel[c].add(difference[c], x, y), all.add(difference[c], x, y);
    }
  ImageDifference out;
  out.width = a.width, out.height = a.height;
  for (int c = 0; c < 4; ++c) out.channel[c] = channel[c].finish();
  out.overall = all.finish();
  if (!a.pixels.empty()) out.within = double(within) / double(a.pixels.size());
  out.psnr = -20 * std::log10(out.overall.rmse);
  compareLayers(a, b, out);
  return out;
}

std::vector<std::string> failuresOf(const LayerDifference& layer, const CompareLimits& limits) {
  std::vector<std::string> found;
  if (!(layer.within >= limits.within))
    found.push_back(fmt::format("{}: {:.4f} % of the pixels are within 2/255 of {:.2g}, less than {:g} %", layer.name,
                                100 * layer.within, layer.scale, 100 * limits.within));
  if (layer.channel.notFinite > 0)
    found.push_back(
        fmt::format("{}: {} pixels are not finite and so cannot be compared", layer.name, layer.channel.notFinite));
  return found;
}

std::vector<std::string> failuresOf(const ImageDifference& d, const CompareLimits& limits) {
  std::vector<std::string> found;
  if (!(d.overall.rmse <= limits.rmse))
    found.push_back(fmt::format("RMSE {:.3g} exceeds {:g}", d.overall.rmse, limits.rmse));
  if (!(d.within >= limits.within))
    found.push_back(
        fmt::format("{:.4f} % of the pixels are within 2/255, less than {:g} %", 100 * d.within, 100 * limits.within));
  if (d.overall.notFinite > 0)
    found.push_back(fmt::format("{} pixels are not finite and so cannot be compared", d.overall.notFinite));
  for (const LayerDifference& layer : d.layers)
    for (std::string& failure : failuresOf(layer, limits)) found.push_back(std::move(failure));
  for (const std::string& name : d.onlyInFirst) found.push_back(fmt::format("only the first picture has {}", name));
  for (const std::string& name : d.onlyInSecond) found.push_back(fmt::format("only the second picture has {}", name));
  return found;
}

std::string differenceJson(const ImageDifference& d) {
  nlohmann::ordered_json json;
  json["width"] = d.width, json["height"] = d.height;
  json["rmse"] = d.overall.rmse, json["mean"] = d.overall.mean, json["max"] = d.overall.max;
  json["max_at"] = {d.overall.maxX, d.overall.maxY};
  json["not_finite"] = d.overall.notFinite;
  json["tolerance"] = kPixelTolerance, json["within"] = d.within;
  json["psnr"] = std::isfinite(d.psnr) ? nlohmann::ordered_json(d.psnr) : nlohmann::ordered_json(nullptr);
  const char* const names[] = {"R", "G", "B", "A"};
  for (int c = 0; c < 4; ++c) json["channels"][names[c]] = jsonOf(d.channel[c]);
  for (const LayerDifference& layer : d.layers) {
    json["channels"][layer.name] = jsonOf(layer.channel);
    json["channels"][layer.name]["unmatched"] = layer.unmatched;
    json["channels"][layer.name]["within"] = layer.within;
    json["channels"][layer.name]["scale"] = layer.scale;
    json["channels"][layer.name]["level"] = layer.level;
  }
  json["only_in_first"] = d.onlyInFirst, json["only_in_second"] = d.onlyInSecond;
  return json.dump(2) + "\n";
}

void writeDifferencePng(const std::string& path, const Image& a, const Image& b, float gain) {
  checkSizes(a, b);
  std::vector<std::uint8_t> rgb(a.pixels.size() * 3);
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const vec4 difference = glm::abs(a.pixels[i] - b.pixels[i]);
    const float sum = difference.x + difference.y + difference.z + difference.w;
    for (int c = 0; c < 3; ++c) {
      const float value = std::isfinite(sum) ? gain * std::max(difference[c], difference.w) : c != 1;
      rgb[3 * i + c] = static_cast<std::uint8_t>(std::min(value, 1.0f) * 255 + 0.5f);
    }
  }
  writePngBytes(path, rgb, a.width, a.height);
}

}  // namespace mote
