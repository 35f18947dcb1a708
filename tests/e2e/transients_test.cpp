// SPDX-License-Identifier: GPL-3.0-or-later
// The portal with people walking before it, who stand elsewhere in each photograph.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/estimate_priors.h"
#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"
#include "tests/support/temp_dir.h"

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

/// The portal's photographs in a folder, with walkers painted over the three first.
/// \return the share of each picture that they cover
std::vector<double> write_walkers(const std::filesystem::path& folder) {
  std::filesystem::copy(test::portal_capture(2), folder, std::filesystem::copy_options::recursive);
  Scene scene = portal();
  std::vector<double> out;
  for (const MaskMap& mask : let_walk(scene)) {
    const View& view = scene.views[static_cast<size_t>(scene.input[out.size()])];
    write_png(folder / std::filesystem::relative(view.image_path, scene.folder), view.image);
    const auto covered = std::count(mask.data.begin(), mask.data.end(), 1);
    out.push_back(double(covered) / double(mask.data.size()));
  }
  return out;
}

TEST(Transients, AreToldOfPhotographsThatAreNotUsedYet) {
  const test::TempDir dir;
  const std::vector<double> painted = write_walkers(dir / "photos");
  const std::string info = "info " + (dir / "photos").string() + " --json --views view_01,view_02";
  const auto three = nlohmann::json::parse(test::run_cgs(info + ",view_03").out);
  ASSERT_EQ(three["coarse_depth"].size(), painted.size());
  for (size_t k = 0; k < painted.size(); ++k) {
    const auto& photograph = three["coarse_depth"][k];
    EXPECT_GT(photograph["moving"].get<double>(), 0.9 * painted[k]);
    EXPECT_LT(photograph["moving"].get<double>(), 1.8 * painted[k]) << "with rims";
    EXPECT_GT(photograph["measured"].get<double>(), 0.6);
  }
  const auto two = nlohmann::json::parse(test::run_cgs(info).out);
  EXPECT_TRUE(two["coarse_depth"][0]["moving"].is_null()) << "which of them is right, nobody knows";
  EXPECT_GT(two["coarse_depth"][0]["measured"].get<double>(), 0.6);
}

}  // namespace
}  // namespace cgs::e2e_transients_test
