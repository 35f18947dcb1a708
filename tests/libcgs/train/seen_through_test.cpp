// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/planted_training.h"

namespace cgs::seen_through_test {
namespace {

// All pixels of the first camera's wall and box at a share of their depth, as another camera sees
// them.
struct Planted {
  Camera camera;  // that measured
  DepthMap measured, sigma;
  Gaussians splats;
  std::vector<uint32_t> all;
};

Planted planted(double share) {
  const test::PlantedScene scene = test::planted_scene(0);
  Planted out{scene.scene.views[2].camera, scene.truth[2], scene.priors[2].sigma, {}, {}};
  const Camera& own = scene.scene.views[0].camera;
  for (int y = 0; y < own.height; ++y) {
    for (int x = 0; x < own.width; ++x) {
      const double z = share * double(scene.truth[0](x, y));
      out.splats.position.push_back(own.unproject(x + 0.5, y + 0.5, z).cast<float>());
      out.splats.opacity.push_back(0.25f + 0.001f * float(x));
    }
  }
  out.all.resize(out.splats.size());
  std::iota(out.all.begin(), out.all.end(), 0u);
  return out;
}

double value_of(const Planted& p, double weight, std::vector<float>& gradient) {
  return seen_through(p.splats, p.all, {p.camera, p.measured, p.sigma}, weight, gradient);
}

// What truly hides the wall from the other camera stays, and so do all others in their place.
TEST(SeenThrough, LeavesTrueSurfacesAlone) {
  const Planted p = planted(1);
  std::vector<float> gradient;
  value_of(p, 1, gradient);
  size_t touched = 0;
  for (const float slope : gradient) touched += slope != 0;
  // Pixels at the rim of the box, half of which it covers.
  EXPECT_LT(touched, p.splats.size() / 50);
}

TEST(SeenThrough, LowersWhatStandsBeforeWhatAnotherViewMeasured) {
  const Planted p = planted(0.5);
  std::vector<float> gradient;
  value_of(p, 1, gradient);
  size_t seen = 0;
  size_t touched = 0;
  for (size_t i = 0; i < p.splats.size(); ++i) {
    if (!p.camera.sees(p.camera.project(p.splats.position[i].cast<double>()))) continue;
    ++seen;
    touched += gradient[i] > 0;
  }
  EXPECT_GT(seen, 1000u);
  EXPECT_EQ(touched, seen);
}

TEST(SeenThrough, HasTheDerivativesOfItsDefinition) {
  Planted p = planted(0.9);
  std::vector<float> gradient;
  const double value = value_of(p, 3, gradient);
  double expected = 0;
  for (size_t i = 0; i < p.splats.size(); ++i) {
    expected += double(gradient[i]) * double(p.splats.opacity[i]);  // linear
  }
  EXPECT_GT(value, 0);
  EXPECT_NEAR(value, expected, 1e-6 * value);
  std::vector<float> ignored;
  for (size_t i = 0; i < p.splats.size(); i += 97) {
    const float at = p.splats.opacity[i];
    p.splats.opacity[i] = at + 0.25f;
    const double above = value_of(p, 3, ignored);
    p.splats.opacity[i] = at;
    EXPECT_NEAR(double(gradient[i]), (above - value) / 0.25, 1e-8) << i;
  }
}

TEST(SeenThrough, LooksOnlyAtThoseNamed) {
  Planted p = planted(0.5);
  p.all.resize(p.all.size() / 2);
  std::vector<float> gradient;
  value_of(p, 1, gradient);
  for (size_t i = p.all.size(); i < p.splats.size(); ++i) EXPECT_EQ(gradient[i], 0);
}

TEST(SeenThrough, OfWeightZeroTouchesNothing) {
  std::vector<float> gradient;
  EXPECT_EQ(value_of(planted(0.5), 0, gradient), 0);
  EXPECT_TRUE(gradient.empty());
}

TEST(SeenThrough, RefusesUnequalSizesAndIndicesOfNone) {
  Planted p = planted(0.5);
  std::vector<float> gradient;
  p.all.push_back(static_cast<uint32_t>(p.splats.size()));
  EXPECT_THROW(value_of(p, 1, gradient), InvalidInput);
  p.all.pop_back();
  p.measured = DepthMap(3, 3, 1);
  EXPECT_THROW(value_of(p, 1, gradient), InvalidInput);
}

}  // namespace
}  // namespace cgs::seen_through_test
