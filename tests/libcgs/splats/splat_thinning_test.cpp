// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/splats/splat_thinning.h"

#include <array>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/core/splat_selection.h"
#include "libcgs/reconstruct/model.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/splats/splat_refit.h"
#include "tests/support/reference_rasterizer.h"

namespace cgs::splat_thinning_test {
namespace {

constexpr int kSide = 64;
constexpr int kMargin = 16;  // the wall goes on beyond the photographs
constexpr double kPixel = 1.0 / kSide;

/// Like chance, in [-1, 1].
double chance(int x, int y, int n) {
  const double v = std::sin(12.9898 * x + 78.233 * y + 37.719 * n) * 43758.5453;
  return 2 * (v - std::floor(v)) - 1;
}

void add(Gaussians& g, const Eigen::Vector3d& p, const Eigen::Vector3f& color) {
  g.position.push_back(p.cast<float>());
  g.scale.emplace_back(Eigen::Vector3d(0.5 * kPixel, 0.5 * kPixel, 0.15 * kPixel).cast<float>());
  g.rotation.emplace_back(1.0f, 0.0f, 0.0f, 0.0f);
  g.opacity.push_back(0.6f);
  g.sh.push_back((color - Eigen::Vector3f::Constant(0.5f)) / kShC0);
}

Eigen::Vector3f wall_color(const Eigen::Vector3d& p) {
  return Eigen::Vector3d(0.4 + 0.1 * std::sin(5 * p.x()), 0.4, 0.4 + 0.1 * std::cos(4 * p.y()))
      .cast<float>();
}

constexpr double kStripeFrom = 0.1;  // along x
constexpr double kStripeTo = 0.13;   // two pixels
const Eigen::Vector3f kStripe(0.1f, 0.1f, -0.1f);

bool on_stripe(const Eigen::Vector3d& p) { return p.x() >= kStripeFrom && p.x() < kStripeTo; }

Eigen::Vector3f striped_color(const Eigen::Vector3d& p) {
  return wall_color(p) + (on_stripe(p) ? kStripe : Eigen::Vector3f::Zero());
}

/// A wall at depth 1 with a splat per pixel of each of some photographs, and a margin beyond them.
/// These are what all splats show, and noise.
struct WallScene {
  Scene scene;
  Gaussians splats;
  std::vector<size_t> counts;
};

struct WallOptions {
  double noise = 0;  // uniform, +-
  int views = 3;
  int side = kSide;      // of the photographs [pixels]
  double radius = 1e9;   // of a disc that the wall is cut to
  double step = 0.0621;  // between the cameras
  std::function<Eigen::Vector3f(const Eigen::Vector3d&)> color = wall_color;
};

WallScene wall_scene(const WallOptions& o) {
  WallScene out;
  for (int n = 0; n < o.views; ++n) {
    View view;
    view.name = std::to_string(n);
    view.camera.width = view.camera.height = o.side;
    view.camera.fx = view.camera.fy = 1 / kPixel;
    view.camera.cx = view.camera.cy = 0.5 * o.side;
    // Not whole pixels apart: splats of different views lie between each other.
    view.camera.world_from_cam.translation() = Eigen::Vector3d(o.step * (n - 1), 0.0173 * n, 0);
    const size_t before = out.splats.size();
    for (int y = -kMargin; y < o.side + kMargin; ++y) {
      for (int x = -kMargin; x < o.side + kMargin; ++x) {
        const Eigen::Vector3d p = view.camera.unproject(x + 0.5, y + 0.5, 1);
        if (p.head<2>().norm() < o.radius) add(out.splats, p, o.color(p));
      }
    }
    out.counts.push_back(out.splats.size() - before);
    out.scene.input.push_back(n);
    out.scene.views.push_back(view);
  }
  for (int n = 0; n < o.views; ++n) {
    View& view = out.scene.views[static_cast<size_t>(n)];
    view.image = picture(rasterize(out.splats, view.camera));
    for (int y = 0; y < o.side; ++y) {
      for (int x = 0; x < o.side; ++x) {
        view.image(x, y).array() += static_cast<float>(o.noise * chance(x, y, n));
      }
    }
  }
  return out;
}

ThinnedSplats thinned(const WallScene& w) { return thin_splats(w.splats, w.scene, w.counts); }

// Mean squared error of one set against another as pictures, between the first two views.
double off_between(const WallScene& w, const Gaussians& fewer, double brightness) {
  Camera camera = w.scene.views[0].camera;
  camera.world_from_cam.translation().x() += 0.02;
  RasterizerOptions on;
  on.background = Eigen::Vector3f::Constant(static_cast<float>(brightness));
  const ColorImage a = rasterize(w.splats, camera, on).color;
  const ColorImage b = rasterize(fewer, camera, on).color;
  double sum = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    sum += (a.data[i] - b.data[i]).cast<double>().squaredNorm() / 3;
  }
  return sum / double(a.data.size());
}

constexpr double kInvisible = 1.0 / (255 * 255);

class ThinSplatsOfAWall : public testing::TestWithParam<double> {};

TEST_P(ThinSplatsOfAWall, NeedsFarFewerAndNobodySees) {
  const WallScene w = wall_scene({.noise = GetParam()});
  const ThinnedSplats out = thinned(w);
  ASSERT_TRUE(out.most_cost.has_value());
  EXPECT_LT(out.splats.size(), w.splats.size() / 8);
  const auto chosen = std::find_if(out.tried.begin(), out.tried.end(), [&](const auto& t) {
    return t.most_cost == *out.most_cost;
  });
  ASSERT_NE(chosen, out.tried.end());
  EXPECT_LE(chosen->loss, kMostThinningLoss);
  EXPECT_EQ(chosen->splats, out.splats.size());
  EXPECT_NEAR(out.pixel, kPixel, 1e-3 * kPixel);
  EXPECT_LT(off_between(w, out.splats, 0), 2 * kInvisible);
  EXPECT_LT(off_between(w, out.splats, 1), 2 * kInvisible);
}

// Red over the columns of a picture between the first two views.
std::vector<double> profile(const WallScene& w, const Gaussians& g) {
  Camera camera = w.scene.views[0].camera;
  camera.world_from_cam.translation().x() += 0.02;
  const ColorImage shown = rasterize(g, camera).color;
  std::vector<double> out(static_cast<size_t>(shown.width), 0);
  for (int y = 0; y < shown.height; ++y) {
    for (int x = 0; x < shown.width; ++x) {
      out[static_cast<size_t>(x)] += double{shown(x, y).x()} / shown.height;
    }
  }
  return out;
}

TEST_P(ThinSplatsOfAWall, KeepsASharpStripe) {
  const WallScene w = wall_scene({.noise = GetParam(), .color = striped_color});
  const ThinnedSplats out = thinned(w);
  ASSERT_TRUE(out.most_cost.has_value());
  EXPECT_LT(out.splats.size(), w.splats.size() / 8);
  const std::vector<double> all = profile(w, w.splats);
  const std::vector<double> fewer = profile(w, out.splats);
  const std::vector<double> bare = profile(wall_scene({}), wall_scene({}).splats);
  double highest = 0;
  for (size_t x = 0; x < all.size(); ++x) {
    highest = std::max(highest, all[x] - bare[x]);
    EXPECT_NEAR(fewer[x], all[x], 0.1 * double{kStripe.x()}) << x;
  }
  EXPECT_GT(highest, 0.5 * double{kStripe.x()});
}

INSTANTIATE_TEST_SUITE_P(Noise, ThinSplatsOfAWall, testing::Values(0.0, 0.02, 0.05));

// By another renderer than the one that was fitted with: slow, and in double.
TEST(ThinSplatsOfASmallWall, LooksTheSameToTheReference) {
  const WallScene w = wall_scene({.noise = 0.02, .side = 32});
  const ThinnedSplats out = thinned(w);
  ASSERT_TRUE(out.most_cost.has_value());
  EXPECT_LT(out.splats.size(), w.splats.size() / 8);
  Camera camera = w.scene.views[0].camera;
  camera.world_from_cam.translation().x() += 0.02;
  const Eigen::Vector3d white = Eigen::Vector3d::Ones();
  const auto all = test::rasterize_reference(w.splats, camera, white);
  const auto fewer = test::rasterize_reference(out.splats, camera, white);
  constexpr double kStep = 1.0 / 255;
  for (size_t i = 0; i < all.color.data.size(); ++i) {
    EXPECT_LT((all.color.data[i] - fewer.color.data[i]).cwiseAbs().maxCoeff(), 4 * kStep) << i;
    EXPECT_NEAR(all.alpha.data[i], fewer.alpha.data[i], 4 * kStep) << i;
  }
}

// Of fourteen views every other one is fitted to and judged by. The last is none of these, and
// alone sees the end of the wall.
TEST(ThinSplatsOfALongWall, KeepsWhatAnyViewShows) {
  const WallScene w = wall_scene({.noise = 0.05, .views = 14, .side = 32, .step = 0.06});
  const ThinnedSplats out = thinned(w);
  ASSERT_TRUE(out.unseen_psnr.has_value());
  ASSERT_TRUE(out.most_cost.has_value());
  EXPECT_LT(out.splats.size(), w.splats.size() / 8);
  for (const size_t n : {size_t{6}, size_t{7}, size_t{13}}) {
    const std::vector<Camera> camera = {w.scene.views[n].camera};
    const auto all = pictures_to_match(w.splats, camera);
    const auto fewer = pictures_to_match(out.splats, camera);
    EXPECT_LT(mean_square_difference(all[0], fewer[0]), 1e-3) << n;
  }
}

// What differs from pixel to pixel by more than photographs differ from each other is no detail to
// merge.
TEST(ThinSplatsOfATexturedWall, KeepsWhatPhotographsShow) {
  const auto texture = [](const Eigen::Vector3d& p) -> Eigen::Vector3f {
    return wall_color(p) + Eigen::Vector3f::Constant(static_cast<float>(
                               0.4 * chance(int(64 * p.x() + 99), int(64 * p.y() + 99), 0)));
  };
  const WallScene plain = wall_scene({.noise = 0.02});
  const WallScene textured = wall_scene({.noise = 0.02, .color = texture});
  EXPECT_GT(thinned(textured).splats.size(), 4 * thinned(plain).splats.size());
}

class ThinSplatsTest : public testing::Test {
 protected:
  WallScene w_ = wall_scene({.noise = 0.05});
};

TEST_F(ThinSplatsTest, ChoosesAndGivesTheSameForAnyNumberOfThreads) {
  const ThinnedSplats first = thinned(w_);
  for (const size_t threads : {size_t{1}, size_t{4}}) {
    const tbb::global_control some(tbb::global_control::max_allowed_parallelism, threads);
    const ThinnedSplats again = thinned(w_);
    EXPECT_EQ(first.most_cost, again.most_cost);
    EXPECT_EQ(first.splats.position, again.splats.position);
    EXPECT_EQ(first.splats.scale, again.splats.scale);
    EXPECT_EQ(first.splats.rotation, again.splats.rotation);
    EXPECT_EQ(first.splats.opacity, again.splats.opacity);
    EXPECT_EQ(first.splats.sh, again.splats.sh);
  }
}

// Splats that show each other's photographs without any error leave no room for one.
TEST_F(ThinSplatsTest, KeepsAllWhereAnyLossWouldShow) {
  const Gaussians one = w_.splats;
  w_.scene.views.resize(2);
  w_.scene.input = {0, 1};
  w_.scene.views[1].camera = w_.scene.views[0].camera;
  const size_t own = w_.counts[0];
  std::vector<uint8_t> keep(one.size(), 0);
  std::fill_n(keep.begin(), own, uint8_t{1});
  keep_only(w_.splats, keep);
  for (size_t i = 0; i < own; ++i) {  // colours that cannot be merged without a trace
    w_.splats.sh[i] *= static_cast<float>(1 + 0.5 * std::sin(double(i * i)));
  }
  const ColorImage shown = picture(rasterize(w_.splats, w_.scene.views[0].camera));
  for (View& view : w_.scene.views) view.image = shown;
  const Gaussians first = w_.splats;
  for (size_t i = 0; i < own; ++i) {  // the second layer shows the same
    w_.splats.position.push_back(first.position[i]);
    w_.splats.scale.push_back(first.scale[i]);
    w_.splats.rotation.push_back(first.rotation[i]);
    w_.splats.opacity.push_back(first.opacity[i]);
    w_.splats.sh.push_back(first.sh[i]);
  }
  w_.counts = {own, own};
  const ThinnedSplats out = thinned(w_);
  EXPECT_FALSE(out.most_cost.has_value());
  EXPECT_EQ(out.splats.position, w_.splats.position);
  EXPECT_FALSE(out.tried.empty());
}

// What is empty around an object has no say; the last bits of a picture have, as each pass of a
// refit goes on from the one before.
TEST(ThinSplatsOfADisc, ChoosesAlikeInFramesOfAnySize) {
  const auto textured = [](const Eigen::Vector3d& p) -> Eigen::Vector3f {
    return wall_color(p) + Eigen::Vector3f::Constant(static_cast<float>(
                               0.1 * chance(int(90 * p.x()), int(90 * p.y()), 0)));
  };
  std::vector<ThinnedSplats> out;
  for (const int side : {64, 192}) {
    const WallScene w =
        wall_scene({.noise = 0.05, .side = side, .radius = 0.3, .step = 0.04, .color = textured});
    out.push_back(thinned(w));
    ASSERT_TRUE(out.back().unseen_psnr.has_value());
  }
  ASSERT_EQ(out[0].tried.size(), out[1].tried.size());
  EXPECT_EQ(out[0].most_cost, out[1].most_cost);
  for (size_t k = 0; k < out[0].tried.size(); ++k) {
    EXPECT_EQ(out[0].tried[k].most_cost, out[1].tried[k].most_cost);
    EXPECT_NEAR(out[0].tried[k].loss, out[1].tried[k].loss, 0.3 * out[0].tried[k].loss);
  }
}

// Photographs that hardly meet say nothing of each other.
TEST(ThinSplatsOfASliver, KeepsAll) {
  const WallScene w = wall_scene({.step = 0.978 + kMargin * kPixel});
  const ThinnedSplats out = thinned(w);
  EXPECT_FALSE(out.unseen_psnr.has_value());
  EXPECT_FALSE(out.most_cost.has_value());
  EXPECT_EQ(out.splats.position, w.splats.position);
}

TEST_F(ThinSplatsTest, LeavesSplatsAloneThatAreNotOfTheViews) {
  const std::vector<size_t> more = {w_.counts[0], w_.counts[1], w_.counts[2] + 1};
  const std::vector<size_t> far_fewer = {w_.counts[0], 0, 0};
  for (const auto& counts : {more, far_fewer}) {
    w_.counts = counts;
    const ThinnedSplats out = thinned(w_);
    EXPECT_EQ(out.splats.position, w_.splats.position);
    EXPECT_TRUE(out.tried.empty());
    EXPECT_FALSE(out.most_cost.has_value());
  }
}

TEST_F(ThinSplatsTest, LetsAPaneFollowThoseOfTheViews) {
  w_.counts[2] -= 100;
  EXPECT_FALSE(thinned(w_).tried.empty());
}

// What is merged over the border, or fitted to pictures, lies beside it by no more than its size.
TEST_F(ThinSplatsTest, KeepsTheLabelsOfBothSidesOfABorder) {
  for (const Eigen::Vector3f& p : w_.splats.position) {
    w_.splats.provenance.push_back(p.x() < 0 ? Provenance::Observed : Provenance::Estimated);
  }
  const ThinnedSplats out = thinned(w_);
  ASSERT_TRUE(out.most_cost.has_value());
  ASSERT_LT(out.splats.size(), w_.splats.size() / 2);
  ASSERT_EQ(out.splats.provenance.size(), out.splats.size());
  std::array<size_t, kProvenanceCount> counts{};
  for (size_t i = 0; i < out.splats.size(); ++i) {
    const Provenance label = out.splats.provenance[i];
    ++counts.at(static_cast<size_t>(label));
    const double pixels = double(out.splats.position[i].x()) / kPixel;
    if (label == Provenance::Observed) {
      EXPECT_LT(pixels, 3);
    } else {
      EXPECT_GT(pixels, -kMargin);
    }
  }
  const size_t observed = counts.at(static_cast<size_t>(Provenance::Observed));
  const size_t estimated = counts.at(static_cast<size_t>(Provenance::Estimated));
  EXPECT_EQ(observed + estimated, out.splats.size());
  EXPECT_GT(4 * observed, out.splats.size());
  EXPECT_GT(4 * estimated, out.splats.size());
}

double off_by(const Gaussians& g, const PictureToMatch& wanted) {
  const auto drawn = pictures_to_match(g, std::vector{wanted.camera});
  double sum = 0;
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < wanted.alpha.data.size(); ++i) {
      const double d = double(drawn[0].color[c].data[i]) - double(wanted.color[c].data[i]);
      sum += d * d;
    }
  }
  return sum;
}

TEST_F(ThinSplatsTest, RefitBringsBackWhatWasChanged) {
  const auto wanted = pictures_to_match(w_.splats, std::vector{w_.scene.views[0].camera});
  Gaussians changed = w_.splats;
  for (float& o : changed.opacity) o = 0.4f;
  for (Eigen::Vector3f& c : changed.sh) c += Eigen::Vector3f::Constant(0.05f);
  const double before = off_by(changed, wanted[0]);
  const std::vector<float> pixel(changed.size(), static_cast<float>(kPixel));
  refit_splats(changed, pixel, wanted, 24);
  EXPECT_LT(off_by(changed, wanted[0]), 0.3 * before);
  EXPECT_THROW(refit_splats(changed, pixel, {}, 1), InvalidInput);
}

/// One flat splat, turned, before nothing, seen from three sides.
struct Alone {
  Gaussians splats;
  std::vector<float> pixel = {static_cast<float>(kPixel)};
  std::vector<Camera> cameras;
};

Alone alone() {
  Alone out;
  add(out.splats, Eigen::Vector3d(0.01, -0.02, 1), Eigen::Vector3f(0.7f, 0.4f, 0.2f));
  out.splats.scale[0] = Eigen::Vector3f(5, 2, 1) * static_cast<float>(kPixel);
  out.splats.rotation[0] = Eigen::Vector4f(0.9f, 0.1f, 0.3f, 0.2f).normalized();
  for (const double x : {-0.3, 0.0, 0.3}) {
    Camera camera;
    camera.width = camera.height = kSide;
    camera.fx = camera.fy = 1 / kPixel;
    camera.cx = camera.cy = 0.5 * kSide;
    camera.world_from_cam.translation() = Eigen::Vector3d(x, 0.5 * x * x, 0);
    out.cameras.push_back(camera);
  }
  return out;
}

// Along each axis of its own, and of the world; a gradient of the wrong sign or axis would not.
TEST(RefitSplats, BringsBackSizeAndPlace) {
  const Alone a = alone();
  const auto wanted = pictures_to_match(a.splats, a.cameras);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float factor : {0.85f, 1.3f}) {
      Gaussians changed = a.splats;
      changed.scale[0][axis] *= factor;
      refit_splats(changed, a.pixel, wanted, 120);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(changed.scale[0][k] / a.splats.scale[0][k], 1, 0.03) << axis << " " << k;
      }
    }
    for (const float by : {-0.6f, 0.6f}) {
      Gaussians changed = a.splats;
      changed.position[0][axis] += by * static_cast<float>(kPixel);
      refit_splats(changed, a.pixel, wanted, 120);
      EXPECT_LT((changed.position[0] - a.splats.position[0]).norm(), 0.1 * kPixel) << axis;
    }
  }
}

// What looks longer from the fitted cameras alone would be a veil from others.
TEST(RefitSplats, LetsNothingGrowByMoreThanAFifth) {
  const Alone a = alone();
  Gaussians longer = a.splats;
  longer.scale[0] *= 3;
  Gaussians changed = a.splats;
  refit_splats(changed, a.pixel, pictures_to_match(longer, a.cameras), 120);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(changed.scale[0][k] / a.splats.scale[0][k], 1.2, 1e-3) << k;
  }
}

// Black on black is told from nothing: alpha counts.
TEST(MeanSquareDifference, SeesWhatIsMissingOnAnyBackground) {
  Alone a = alone();
  a.splats.scale[0] = Eigen::Vector3f(100, 100, 1);  // fills the frame
  a.splats.rotation[0] = Eigen::Vector4f(1, 0, 0, 0);
  for (const float grey : {0.0f, 1.0f}) {
    a.splats.sh[0].setConstant((grey - 0.5f) / kShC0);
    a.splats.opacity[0] = 0.8f;
    const auto one = pictures_to_match(a.splats, std::span(a.cameras).first(1));
    EXPECT_EQ(mean_square_difference(one[0], one[0]), 0);
    a.splats.opacity[0] = 0.6f;
    const auto other = pictures_to_match(a.splats, std::span(a.cameras).first(1));
    EXPECT_NEAR(mean_square_difference(one[0], other[0]), 0.5 * 0.2 * 0.2, 1e-4) << grey;
  }
}

}  // namespace
}  // namespace cgs::splat_thinning_test
