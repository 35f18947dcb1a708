// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/surroundings_painter.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/nan.h"
#include "libcgs/render/hidden_depth.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "tests/support/panel_model.h"

namespace cgs::surroundings_painter_test {
namespace {

using test::kBackWall;
using test::panel_camera;
using test::panel_color;
using test::panel_model;

constexpr double kAside = 0.9;  // where what the panel hid is seen

/// What is painted as seen from aside, and what it was painted on.
struct Aside {
  RenderBuffers shown;
  MaskMap open;
  DepthMap hidden;
  PaintedSurroundings painted;

  size_t count(bool is_painted) const {
    size_t out = 0;
    for (size_t i = 0; i < open.data.size(); ++i) {
      out += open.data[i] != 0 && (painted.left_open.data[i] == 0) == is_painted ? 1 : 0;
    }
    return out;
  }
};

Aside seen_from(const Model& model, double x) {
  const std::vector<SupportView> inputs = support_views(model);
  const Camera camera = panel_camera(x);
  Aside out;
  out.shown = render_camera(model, inputs, camera);
  out.open = MaskMap(camera.width, camera.height, 0);
  for (size_t i = 0; i < out.open.data.size(); ++i) {
    out.open.data[i] = is_hole(out.shown.hole.data[i]) ? 1 : 0;
  }
  out.hidden = hidden_depth(out.shown, out.open);
  out.painted = painted_surroundings({camera, inputs, out.shown, out.open, out.hidden});
  return out;
}

// The wall's colours change slowly along it, the panel is red.
TEST(SurroundingsPainter, PaintsTheWallBehindThePanel) {
  const Aside aside = seen_from(panel_model(), kAside);
  EXPECT_GT(aside.count(true), 200u);
  const Camera camera = panel_camera(kAside);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if (aside.open(x, y) == 0 || aside.painted.left_open(x, y) != 0) continue;
      const Eigen::Vector3d p = camera.unproject(x + 0.5, y + 0.5, kBackWall);
      const Eigen::Vector3f wall = panel_color(p.x(), p.y(), kBackWall);
      ASSERT_LT((aside.painted.picture(x, y) - wall).norm(), 0.25f) << x << ", " << y;
    }
  }
}

TEST(SurroundingsPainter, CoversTheBandBehindThePanelAndNothingElse) {
  const Model model = panel_model();
  const Camera camera = panel_camera(kAside);
  const RenderBuffers before = render_camera(model, support_views(model), camera);
  MaskMap painted(camera.width, camera.height, 0);
  const PaintedFill made = lift_painted(model, {camera}, [&](size_t, const ViewToPaint& view) {
    PaintedSurroundings out = painted_surroundings(view);
    for (size_t i = 0; i < painted.data.size(); ++i) {
      painted.data[i] = view.open.data[i] != 0 && out.left_open.data[i] == 0 ? 1 : 0;
    }
    return PaintedView{camera, out.picture, {"hole_1.png", "ab"}, out.left_open};
  });
  const RenderBuffers after = with_fill(before, rasterize(made.gaussians, camera));
  size_t covered = 0;
  size_t band = 0;
  for (size_t i = 0; i < painted.data.size(); ++i) {
    band += painted.data[i];
    covered += painted.data[i] != 0 && after.alpha.data[i] > 0.95f ? 1 : 0;
    if (!is_hole(before.hole.data[i])) ASSERT_EQ(after.color.data[i], before.color.data[i]);
  }
  EXPECT_GT(band, 200u);
  EXPECT_GT(double(covered), 0.95 * double(band));
}

TEST(SurroundingsPainter, LeavesOpenWhatIsFarFromAllThatIsShown) {
  const Aside aside = seen_from(panel_model(), kAside + 0.9);  // mostly wall that no input shows
  EXPECT_GT(aside.count(true), 200u);
  EXPECT_GT(aside.count(false), 200u);
  const int most = panel_camera(0).width / 12;
  for (int y = 0; y < aside.open.height; ++y) {
    for (int x = 0; x < aside.open.width; ++x) {
      if (aside.open(x, y) == 0 || aside.painted.left_open(x, y) != 0) continue;
      int nearest = aside.open.width + aside.open.height;
      for (int v = 0; v < aside.open.height; ++v) {
        for (int u = 0; u < aside.open.width; ++u) {
          if (aside.open(u, v) == 0) nearest = std::min(nearest, std::abs(u - x) + std::abs(v - y));
        }
      }
      ASSERT_LE(nearest, most) << x << ", " << y;
    }
  }
}

// Photographs show what was left out of their depth, be it another thing than its surroundings.
TEST(SurroundingsPainter, LeavesOpenWhatAPhotographLooksAt) {
  Model model = panel_model();
  DepthMap& depth = model.priors[2].depth;
  for (float& z : depth.data) {
    if (z < kBackWall) z = kNaN;  // the panel, behind which the hole lies
  }
  const Camera& looking = model.scene.views[2].camera;
  const Camera camera = panel_camera(kAside);
  const Aside aside = seen_from(model, kAside);
  size_t looked_at = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if (aside.open(x, y) == 0) continue;
      const Eigen::Vector3d uvz =
          looking.project(camera.unproject(x + 0.5, y + 0.5, double{aside.hidden(x, y)}));
      if (!looking.sees(uvz) || !std::isnan(depth(int(uvz.x()), int(uvz.y())))) continue;
      ++looked_at;
      ASSERT_EQ(aside.painted.left_open(x, y), 1) << x << ", " << y;
    }
  }
  EXPECT_GT(looked_at, 200u);
}

TEST(SurroundingsPainter, LeavesTheSkyOpen) {
  Model model = panel_model();
  for (ViewPriors& priors : model.priors) {
    for (size_t i = 0; i < priors.depth.data.size(); ++i) {
      if (priors.depth.data[i] == static_cast<float>(kBackWall)) {
        priors.origin.data[i] = DepthOrigin::Sky;
      }
    }
  }
  EXPECT_EQ(seen_from(model, kAside).count(true), 0u);
}

}  // namespace
}  // namespace cgs::surroundings_painter_test
