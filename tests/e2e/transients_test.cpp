// SPDX-License-Identifier: GPL-3.0-or-later
// The portal with people walking before it, who stand elsewhere in each photograph.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "io/scenes/scene_reader.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/estimate_priors.h"
#include "tests/support/portal_capture.h"

namespace cgs::e2e_transients_test {
namespace {

constexpr double kHeight = 0.3;  // of a walker [picture heights]

/// A head, a coat and trousers with a weave, that stand at a place [picture sizes].
struct Walker {
  double x, y;
  Eigen::Vector3f coat;
  Eigen::Vector3f trousers;

  /// \return black where it is not
  Eigen::Vector3f at(int px, int py, const ColorImage& image) const {
    const double size = kHeight * image.height;
    const double up = (y * image.height - py) / size;  // 0 to 1
    const double aside = std::abs(px - x * image.width) / size;
    const double half_width = up > 0.85 ? 0.08 : up > 0.45 ? 0.16 : 0.13;
    if (up < 0 || up > 1 || aside > half_width) return Eigen::Vector3f::Zero();
    const float weave = 0.05f * std::sin(0.9f * float(px) + 1.3f * float(py));
    const Eigen::Vector3f skin(0.75f, 0.55f, 0.45f);
    const Eigen::Vector3f color = up > 0.85 ? skin : up > 0.45 ? coat : trousers;
    return (color.array() + weave).max(0.02f);
  }
};

/// Two walkers in the outer photographs, one in the middle one.
const std::vector<std::vector<Walker>> kWalkers = {
    {{0.24, 0.75, {0.2f, 0.25f, 0.5f}, {0.1f, 0.1f, 0.12f}},
     {0.6, 0.8, {0.8f, 0.2f, 0.2f}, {0.2f, 0.2f, 0.25f}}},
    {{0.4, 0.78, {0.2f, 0.25f, 0.5f}, {0.1f, 0.1f, 0.12f}}},
    {{0.75, 0.76, {0.9f, 0.85f, 0.3f}, {0.15f, 0.1f, 0.1f}},
     {0.5, 0.72, {0.2f, 0.6f, 0.3f}, {0.3f, 0.3f, 0.6f}}}};

Scene portal() {
  SceneOptions options;
  options.views = "view_01,view_02,view_03";
  Scene scene = read_scene(test::portal_capture(2), options);
  load_images(scene, scene.input);
  to_canonical(scene);
  return scene;
}

/// \return where they are
std::vector<MaskMap> let_walk(Scene& scene) {
  std::vector<MaskMap> out;
  for (size_t i = 0; i < scene.input.size(); ++i) {
    ColorImage& image = scene.views[static_cast<size_t>(scene.input[i])].image;
    MaskMap& mask = out.emplace_back(image.width, image.height, 0);
    for (const Walker& walker : kWalkers[i]) {
      for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
          const Eigen::Vector3f color = walker.at(x, y, image);
          if (color.isZero(0)) continue;
          image(x, y) = color;
          mask(x, y) = 1;
        }
      }
    }
  }
  return out;
}

TEST(Transients, AreLeftOutOfThePortalAndChangeNoDepth) {
  Scene scene = portal();
  const EstimatedPriors without = estimate_priors(scene, {});
  const std::vector<MaskMap> walkers = let_walk(scene);
  const EstimatedPriors with = estimate_priors(scene, {});
  for (size_t i = 0; i < walkers.size(); ++i) {
    EXPECT_LT(without.report.coverage[i].transient, 0.002) << "nobody walks there";
    size_t all = 0;
    size_t found = 0;
    size_t more = 0;
    size_t measured_before = 0;
    size_t measured = 0;
    std::vector<double> changes;
    const auto& before = without.views[i];
    const auto& after = with.views[i];
    for (size_t p = 0; p < walkers[i].data.size(); ++p) {
      const bool is_found = after.origin.data[p] == DepthOrigin::Transient;
      if (walkers[i].data[p] != 0) {
        ++all;
        found += is_found ? 1 : 0;
        continue;
      }
      more += is_found ? 1 : 0;
      if (is_found || before.origin.data[p] != DepthOrigin::Measured) continue;
      ++measured_before;
      if (after.origin.data[p] != DepthOrigin::Measured) continue;
      ++measured;
      changes.push_back(std::abs(double{after.depth.data[p]} / double{before.depth.data[p]} - 1));
    }
    EXPECT_GT(double(found), 0.9 * double(all)) << i;
    EXPECT_LT(double(more), 0.6 * double(all)) << i << ": rims, and what is between arms and legs";
    EXPECT_GT(double(measured), 0.95 * double(measured_before)) << i;
    EXPECT_LT(median(changes), 1e-3) << i;
    EXPECT_NEAR(with.report.coverage[i].transient,
                double(found + more) / double(walkers[i].data.size()),
                1e-9);
  }
}

}  // namespace
}  // namespace cgs::e2e_transients_test
