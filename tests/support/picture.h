// Pictures and their failures, for tests of files and comparisons.
#pragma once
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <limits>
#include <string>

#include "host/core/random.h"
#include "host/image/exr.h"

namespace mote::test {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr ExrCompression kCompressions[] = {ExrCompression::None, ExrCompression::Rle, ExrCompression::Zips,
                                                   ExrCompression::Zip, ExrCompression::Piz};

inline Image noise(int width, int height, bool withDepth) {
  Image image(width, height, withDepth);
  Random random(1);
  for (vec4& p : image.pixels)
    for (int c = 0; c < 4; ++c) p[c] = static_cast<float>(std::exp(random.uniform(-9, 6)));
  for (float& z : image.depth) z = random.uniform() < 0.1 ? kNoDepth : static_cast<float>(random.uniform(0.1, 5e4));
  return image;
}

/// A picture with every array that an Image may have, each number different.
inline Image layered(int width, int height) {
  Image image = noise(width, height, true);
  const std::size_t pixels = image.pixels.size();
  image.alpha.resize(pixels), image.opticalDepth.resize(pixels), image.velocity.resize(pixels);
  image.layers = {{"light.key.R", std::vector<float>(pixels), true}, {"shadow.key", std::vector<float>(pixels), false}};
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto n = static_cast<float>(i);
    image.alpha[i] = vec3(0.25f, 0.5f, 0.75f) + n;  // exact in half up to 512
    image.opticalDepth[i] = n + 0.1f;
    image.velocity[i] = vec2(n, -n - 0.3f);
    image.layers[0].values[i] = n / 2;
    image.layers[1].values[i] = n / 7;
  }
  return image;
}

/// Runs body, which must throw Exception, and returns its message.
template <class Exception, class Body>
std::string messageOf(const Body& body) {
  try {
    body();
  } catch (const Exception& e) {
    return e.what();
  } catch (const std::exception& e) {
    ADD_FAILURE() << "another exception: " << e.what();
    return {};
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

/// A disk that takes `bytes` and then no more: write() fails with EFBIG while this lives.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &limit_);
    const rlimit small{bytes, limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  void (*handler_)(int);
  rlimit limit_{};
};

}  // namespace mote::test
