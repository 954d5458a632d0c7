// Phase functions against their definitions: normalisation, mean cosine and symmetry by quadrature.
#include "host/lighting/phase.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace mote {
namespace {

/// ∫ f(cos θ) dω over the sphere by Simpson's rule in μ = cos θ; 2^17 steps resolve HG's peak for |g| ≤ 0.95 to 1e-6.
double overSphere(const std::function<double(double)>& f) {
  constexpr int kSteps = 1 << 17;
  double sum = f(-1) + f(1);
  for (int i = 1; i < kSteps; ++i) sum += (i % 2 ? 4 : 2) * f(-1 + 2.0 * i / kSteps);
  return 2 * kPi * sum * (2.0 / kSteps) / 3;
}

double integral(const PhaseFunction& phase) {
  return overSphere([&](double mu) { return phase(static_cast<float>(mu)); });
}

double meanCosine(const PhaseFunction& phase) {
  return overSphere([&](double mu) { return mu * phase(static_cast<float>(mu)); });
}

// Single precision: each value is off by up to 1e-6 of itself, near the peak of g = 0.95 by 1e-5 (1 − g is).
TEST(Phase, EveryKindIntegratesToOne) {
  EXPECT_NEAR(integral({PhaseKind::Isotropic, 0}), 1, 1e-6);
  EXPECT_NEAR(integral({PhaseKind::Rayleigh, 0}), 1, 1e-6);
  for (const float g : {-0.95f, -0.5f, 0.0f, 0.3f, 0.8f, 0.95f})
    EXPECT_NEAR(integral({PhaseKind::HenyeyGreenstein, g}), 1, 3e-5) << g;
}

TEST(Phase, HenyeyGreensteinsMeanCosineIsG) {
  for (const float g : {-0.95f, -0.5f, 0.0f, 0.3f, 0.8f, 0.95f})
    EXPECT_NEAR(meanCosine({PhaseKind::HenyeyGreenstein, g}), g, 3e-5) << g;
  EXPECT_NEAR(meanCosine({PhaseKind::Rayleigh, 0}), 0, 1e-6);
}

TEST(Phase, IsSymmetricWhereItShouldBe) {
  for (int i = 0; i <= 100; ++i) {
    const float mu = -1 + 0.02f * static_cast<float>(i);
    const PhaseFunction rayleigh{PhaseKind::Rayleigh, 0}, isotropic{};
    EXPECT_EQ(rayleigh(mu), rayleigh(-mu));
    EXPECT_NEAR((PhaseFunction{PhaseKind::HenyeyGreenstein, 0}(mu)), isotropic(mu), 1e-8);
    for (const float g : {0.2f, 0.7f, 0.99f})
      EXPECT_EQ((PhaseFunction{PhaseKind::HenyeyGreenstein, g}(mu)),
                (PhaseFunction{PhaseKind::HenyeyGreenstein, -g}(-mu)));
  }
}

TEST(Phase, ForwardIsAlongTheLightsTravel) {
  const PhaseFunction forward{PhaseKind::HenyeyGreenstein, 0.8f};
  EXPECT_GT(forward(1), 100 * forward(-1));
  // (1 + g) / (1 − g)² : (1 + g)² / (1 − g)² …: p(1) / p(−1) = ((1 + g) / (1 − g))³.
  EXPECT_NEAR(forward(1) / forward(-1), std::pow(1.8 / 0.2, 3), 0.01);
  // A cosine that rounding has pushed past 1 is 1.
  EXPECT_EQ(forward(1.0000001f), forward(1));
}

TEST(Viewer, LooksTowardTheCamera) {
  EXPECT_EQ((Viewer{.eye = {0, 0, 5}}.directionFrom({0, 0, 1})), vec3(0, 0, 1));
  EXPECT_EQ((Viewer{.eye = {0, 0, 5}}.directionFrom({0, 3, 5})), vec3(0, -1, 0));
  EXPECT_EQ((Viewer{.eye = {9, 9, 9}, .parallel = true, .toCamera = {1, 0, 0}}.directionFrom({0, 3, 5})),
            vec3(1, 0, 0));
}

}  // namespace
}  // namespace mote
