// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/pane_layers.h"

#include <gtest/gtest.h>

#include "libcgs/priors/front_plane.h"
#include "tests/support/pane_scene.h"

namespace cgs::pane_layers_test {
namespace {

constexpr float kOpacity = 0.3f;
constexpr double kCell = 0.06;

class PaneLayersTest : public testing::Test {
 protected:
  static std::vector<Camera> cameras() {
    std::vector<Camera> out;
    for (const double x : {-0.6, 0.0, 0.6}) {
      out.push_back(test::looking_at({x, 0.1 * x * x, 0}, {0.5 * x, 0, 6}, 240, 180, 240));
    }
    return out;
  }

  // As they are.
  PanePlaces true_places() const {
    const Eigen::Hyperplane<double, 3> plane(Eigen::Vector3d::UnitZ(),
                                             Eigen::Vector3d(0, 0, test::kPaneDepth));
    const Camera& own = planted_.scene.views[1].camera;
    PanePlaces out{.drawn_from = 1, .extent = {}, .in_view = {}, .of_view = {}, .through = {}};
    for (const View& view : planted_.scene.views) {
      out.in_view.push_back(places_on(plane, own, view.camera));
      out.of_view.push_back(places_on(plane, view.camera, own));
      const DepthMap depth = test::true_depth(planted_.both, view.camera);
      MaskMap through(depth.width, depth.height, 0);
      for (size_t i = 0; i < through.data.size(); ++i) through.data[i] = depth.data[i] < 4 ? 1 : 0;
      out.through.push_back(through);
    }
    out.extent = out.through[1];
    return out;
  }

  test::PaneScene planted_ = test::pane_scene(cameras(), kCell, kOpacity);
  std::vector<ViewPriors> priors_ = test::true_priors(planted_.wall, cameras());
  JointSurface surface_ = joint_surface(planted_.scene, priors_);
  PanePlaces places_ = true_places();
};

TEST_F(PaneLayersTest, OpacityIsTheContrastLost) {
  EXPECT_NEAR(contrast_lost(surface_, places_), kOpacity, 0.04);
}

TEST_F(PaneLayersTest, NoContrastIsLostWithoutAPane) {
  const JointSurface bare = joint_surface(planted_.bare, priors_);
  EXPECT_NEAR(contrast_lost(bare, places_), 0, 0.04);
}

TEST_F(PaneLayersTest, PhotographsFollowFromBothLayers) {
  const std::vector<ColorImage> photographs = usable_photographs(surface_);
  const ColorImage colors = pane_colors(surface_, places_, kOpacity, photographs);
  const std::vector<ColorImage> behind = without_pane(places_, kOpacity, colors, photographs);
  double before = 0;
  double after = 0;
  for (size_t v = 0; v < behind.size(); ++v) {
    for (size_t i = 0; i < behind[v].data.size(); ++i) {
      const Eigen::Vector3f& bare = planted_.bare.views[v].image.data[i];
      before += double((photographs[v].data[i] - bare).squaredNorm());
      after += double((behind[v].data[i] - bare).squaredNorm());
      if (places_.through[v].data[i] == 0) EXPECT_EQ(behind[v].data[i], photographs[v].data[i]);
    }
  }
  EXPECT_LT(after, 0.1 * before);
}

TEST_F(PaneLayersTest, ForetellsOnlyWhatIsThere) {
  EXPECT_GT(foretelling_gain(surface_, places_, kOpacity), 3);
  const JointSurface bare = joint_surface(planted_.bare, priors_);
  EXPECT_LT(foretelling_gain(bare, places_, kOpacity), 0);
}

}  // namespace
}  // namespace cgs::pane_layers_test
