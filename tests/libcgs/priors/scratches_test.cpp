// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/scratches.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/colored_wall.h"

namespace cgs::scratches_test {
namespace {

using Eigen::Vector3f;

// A line from the top to the bottom, one pixel wide.
bool is_scratch(int x, int y) { return x == 60 + y / 3; }

void scratch(View& view, const Vector3f& color) {
  for (int y = 0; y < view.image.height; ++y) {
    for (int x = 0; x < view.image.width; ++x) {
      if (is_scratch(x, y)) view.image(x, y) = color;
    }
  }
}

size_t count(const MaskMap& mask) {
  return static_cast<size_t>(std::count(mask.data.begin(), mask.data.end(), 1));
}

TEST(MendScratches, GivesThemTheColorsOfOthers) {
  test::ColoredWall wall;
  const ColorImage clean = wall.scene.views[1].image;
  scratch(wall.scene.views[1], {0.98f, 0.97f, 0.95f});
  const ColorImage scratched = wall.scene.views[1].image;
  const std::vector<MaskMap> mended = mend_scratches(wall.scene, wall.priors);
  size_t found = 0;
  size_t all = 0;
  double before = 0;
  double after = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      if (!is_scratch(x, y)) continue;
      const auto is_seen = [&](size_t other) {
        const Camera& camera = wall.scene.views[1].camera;
        const double depth{wall.priors[1].depth(x, y)};
        const auto uvz =
            wall.scene.views[other].camera.project(camera.unproject(x + 0.5, y + 0.5, depth));
        return wall.scene.views[other].camera.sees(uvz);
      };
      if (!is_seen(0) || !is_seen(2)) continue;
      ++all;
      found += mended[1](x, y);
      const auto off = [&](const ColorImage& image) {
        return double{(image(x, y) - clean(x, y)).cwiseAbs().mean()};
      };
      before += off(scratched);
      after += off(wall.scene.views[1].image);
    }
  }
  EXPECT_GT(all, 80u);
  EXPECT_GT(double(found), 0.9 * double(all));
  EXPECT_LT(after, 0.25 * before);
  // Others, which are right, stay.
  EXPECT_LT(count(mended[0]) + count(mended[2]), 100u);
}

TEST(MendScratches, LeavesCleanPhotographsAlone) {
  test::ColoredWall wall;
  const ColorImage before = wall.scene.views[1].image;
  for (const MaskMap& mask : mend_scratches(wall.scene, wall.priors)) {
    EXPECT_LT(count(mask), 60u) << "of 19200: rims of the square";
  }
  size_t changed = 0;
  for (size_t i = 0; i < before.data.size(); ++i) {
    changed += wall.scene.views[1].image.data[i] != before.data[i] ? 1 : 0;
  }
  EXPECT_LT(changed, 60u);
}

TEST(MendScratches, CannotTellWhichOfTwoIsRight) {
  test::ColoredWall wall;
  wall.scene.input = {0, 1};
  wall.priors.pop_back();
  scratch(wall.scene.views[1], Vector3f::Ones());
  const ColorImage scratched = wall.scene.views[1].image;
  for (const MaskMap& mask : mend_scratches(wall.scene, wall.priors)) EXPECT_EQ(count(mask), 0u);
  EXPECT_EQ(wall.scene.views[1].image.data, scratched.data);
}

}  // namespace
}  // namespace cgs::scratches_test
