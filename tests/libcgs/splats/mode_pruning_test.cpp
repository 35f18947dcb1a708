// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/mode_pruning.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/planted_training.h"

namespace cgs::mode_pruning_test {
namespace {

// Wall and box as a training starts from them.
Gaussians surface(const test::PlantedScene& planted) {
  return Trainer(planted.scene, planted.priors, test::short_training(0)).model().gaussians();
}

std::vector<Camera> cameras_of(const test::PlantedScene& planted) {
  std::vector<Camera> out;
  for (const View& view : planted.scene.views) out.push_back(view.camera);
  return out;
}

struct Kept {
  double floaters, surface;  // shares
};

// Splats of an opacity halfway between the first camera and the wall, which shift the mean.
Kept kept_with_floaters(float opacity) {
  const test::PlantedScene planted = test::planted_scene(0);
  Gaussians all = surface(planted);
  // So large and opaque that few of them make up what a pixel shows.
  for (float& own : all.opacity) own = 0.95f;
  for (Eigen::Vector3f& scale : all.scale) scale *= 1.5f;
  const size_t count = all.size();
  const Camera& camera = planted.scene.views[0].camera;
  for (int y = 10; y < 46; y += 2) {
    for (int x = 2; x < 70; x += 2) {
      all.position.push_back(camera.unproject(x + 0.5, y + 0.5, 0.4).cast<float>());
      all.scale.push_back(Eigen::Vector3f::Constant(0.008f));
      all.rotation.emplace_back(1.0f, 0.0f, 0.0f, 0.0f);
      all.opacity.push_back(opacity);
      all.sh.resize(all.size() * static_cast<size_t>(all.sh_count()), Eigen::Vector3f::Zero());
    }
  }
  const std::vector<uint8_t> keep = test::kept_by_mode(all, {camera}, 0.05);
  const auto share = [&](size_t first, size_t last) {
    const auto begin = keep.begin();
    return double(std::count(
               begin + static_cast<ptrdiff_t>(first), begin + static_cast<ptrdiff_t>(last), 1)) /
           double(last - first);
  };
  return {share(count, all.size()), share(0, count)};
}

TEST(KeptByMode, TakesAwayFaintSplatsBeforeASurfaceAndLeavesIt) {
  const Kept kept = kept_with_floaters(0.05f);
  EXPECT_LT(kept.floaters, 0.1);
  EXPECT_GT(kept.surface, 0.95);
}

// A surface of many splats has no strong one: then a floater is the strongest itself, and stays.
TEST(KeptByMode, MissesFloatersThatAreStrongerThanOneSplatOfTheSurface) {
  EXPECT_GT(kept_with_floaters(0.3f).floaters, 0.5);
}

TEST(KeptByMode, LeavesACleanSetAlmostAlone) {
  const test::PlantedScene planted = test::planted_scene(0);
  const std::vector<uint8_t> keep = test::kept_by_mode(surface(planted), cameras_of(planted), 0.05);
  EXPECT_GT(double(std::count(keep.begin(), keep.end(), 1)), 0.97 * double(keep.size()));
}

}  // namespace
}  // namespace cgs::mode_pruning_test
