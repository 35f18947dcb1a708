// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/painted_fill.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "tests/support/panel_model.h"

namespace cgs::painted_fill_test {
namespace {

using test::kBackWall;
using test::panel_camera;
using test::panel_depth;
using test::panel_model;

constexpr double kAside = 0.9;  // where what the panel hid is seen

RenderBuffers drawn(const Model& model, const Camera& camera) {
  return render_camera(model, support_views(model), camera);
}

// What a painter makes of the holes seen from (x, 0, 0).
PaintedView painted_at(const Model& model, double x, const Eigen::Vector3f& color) {
  PaintedView out{panel_camera(x), {}, {"painted.png", "ab"}};
  const RenderBuffers buffers = drawn(model, out.camera);
  out.picture = picture(buffers);
  for (size_t i = 0; i < out.picture.data.size(); ++i) {
    if (is_hole(buffers.hole.data[i])) out.picture.data[i] = color;
  }
  return out;
}

const Eigen::Vector3f kPaint(0.2f, 0.7f, 0.3f);

TEST(PaintedFill, LiesOnTheWallThatGoesOnBehindThePanel) {
  const Model model = panel_model();
  const PaintedFill fill = lift_painted(model, {painted_at(model, kAside, kPaint)});
  ASSERT_EQ(fill.views.size(), 1u);
  const ViewFill& told = fill.views[0];
  EXPECT_GT(told.holes, 200u);
  EXPECT_EQ(told.filled_before, 0u);
  EXPECT_EQ(told.lifted + told.unplaced + told.shone_through, told.holes);
  EXPECT_GT(double(told.lifted), 0.7 * double(told.holes));
  ASSERT_EQ(fill.gaussians.size(), told.lifted);
  size_t on_wall = 0;
  for (const Eigen::Vector3f& p : fill.gaussians.position) {
    on_wall += std::abs(p.z() - kBackWall) < 0.1 * kBackWall ? 1 : 0;
  }
  EXPECT_GT(double(on_wall), 0.9 * double(fill.gaussians.size()));
}

TEST(PaintedFill, IsTaggedAndLabelledAsMadeUp) {
  const Model model = panel_model();
  const Gaussians fill = lift_painted(model, {painted_at(model, kAside, kPaint)}).gaussians;
  EXPECT_EQ(synthetic_count(fill), fill.size());
  ASSERT_EQ(fill.synthetic_sources.size(), 1u);
  EXPECT_EQ(fill.synthetic_sources[0], (SyntheticSource{"painted.png", "ab"}));
  for (const Provenance label : fill.provenance) EXPECT_EQ(label, Provenance::Inferred);
}

TEST(PaintedFill, HasNothingWhereAViewWasLeftOpen) {
  const Model model = panel_model();
  PaintedView view = painted_at(model, kAside, kPaint);
  const ViewFill all = lift_painted(model, {view}).views[0];
  view.left_open = MaskMap(view.camera.width, view.camera.height, 0);
  for (int y = 0; y < view.camera.height / 2; ++y) {
    for (int x = 0; x < view.camera.width; ++x) view.left_open(x, y) = 1;
  }
  const PaintedFill fill = lift_painted(model, {view});
  const ViewFill& told = fill.views[0];
  EXPECT_EQ(told.holes, all.holes);
  EXPECT_GT(told.left_open, 100u);
  EXPECT_EQ(told.lifted + told.left_open + told.unplaced + told.shone_through, told.holes);
  EXPECT_GT(told.lifted, 100u);
  for (const Eigen::Vector3f& p : fill.gaussians.position) {
    EXPECT_GE(view.camera.project(p.cast<double>()).y(), double(view.camera.height) / 2);
  }
  view.left_open = MaskMap(3, 3, 1);
  EXPECT_THROW(lift_painted(model, {view}), InvalidInput);
}

// Each view is painted by one who sees what was painted before.
TEST(PaintedFill, ShowsAPainterWhatWasPaintedBefore) {
  const Model model = panel_model();
  const std::vector<Camera> cameras(2, panel_camera(kAside));
  std::vector<size_t> open;
  std::vector<Eigen::Vector3f> middle;
  const auto paint = [&](size_t k, const ViewToPaint& view) {
    PaintedView out = painted_at(model, kAside, kPaint);
    open.push_back(
        static_cast<size_t>(std::count(view.open.data.begin(), view.open.data.end(), 1)));
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float count = 0;
    for (size_t i = 0; i < view.open.data.size(); ++i) {
      if (!is_hole(view.shown.hole.data[i]) || view.open.data[i] != 0) continue;
      sum += picture(view.shown).data[i];
      ++count;
    }
    middle.push_back(count > 0 ? Eigen::Vector3f(sum / count) : sum);
    EXPECT_EQ(&view.camera, &cameras[k]);
    return out;
  };
  const PaintedFill fill = lift_painted(model, cameras, paint);
  ASSERT_EQ(open.size(), 2u);
  EXPECT_LT(double(open[1]), 0.3 * double(open[0]));
  EXPECT_EQ(fill.views[1].filled_before, fill.views[1].holes - open[1]);
  EXPECT_GT(middle[1].y(), middle[1].x());  // of the paint
}

// The oracle looks at depth as the photographs state it, not at what is rendered.
TEST(PaintedFill, StandsBeforeNothingThatAPhotographShows) {
  const Model model = panel_model();
  const Gaussians fill = lift_painted(model, {painted_at(model, kAside, kPaint)}).gaussians;
  for (const Eigen::Vector3f& p : fill.position) {
    for (const double at : {-0.2, 0.0, 0.2}) {
      const Camera camera = panel_camera(at);
      const Eigen::Vector3d uvz = camera.project(p.cast<double>());
      if (!camera.sees(uvz)) continue;
      const Eigen::Vector3d centre(std::floor(uvz.x()) + 0.5, std::floor(uvz.y()) + 0.5, 0);
      EXPECT_GT(uvz.z(), panel_depth(at, camera.ray_in_cam(centre.x(), centre.y())));
    }
  }
}

// Neither in pictures of ours, nor in those of programs that draw all splats together.
TEST(PaintedFill, DoesNotShowInInputViews) {
  Model model = panel_model();
  model.fill = lift_painted(model, {painted_at(model, kAside, kPaint)}).gaussians;
  Gaussians dark = model.gaussians;
  for (Eigen::Vector3f& c : dark.sh) c = Eigen::Vector3f::Constant(-0.5f / kShC0);
  Gaussians light = model.fill;
  for (Eigen::Vector3f& c : light.sh) c = Eigen::Vector3f::Constant(0.5f / kShC0);
  append(dark, light);
  for (const double at : {-0.2, 0.0, 0.2}) {
    const RenderBuffers plain = drawn(model, panel_camera(at));
    const RenderBuffers filled = with_fill(plain, rasterize(model.fill, panel_camera(at)));
    float most = 0;
    for (const Eigen::Vector3f& c : rasterize(dark, panel_camera(at)).color.data) {
      most = std::max(most, c.x());
    }
    EXPECT_LE(most, 1.0f / 16);
    for (size_t i = 0; i < plain.color.data.size(); ++i) {
      if (is_hole(plain.hole.data[i])) {
        EXPECT_LT((filled.color.data[i] - plain.color.data[i]).norm(), 1.0f / 255);
      } else {
        EXPECT_EQ(filled.color.data[i], plain.color.data[i]);
        EXPECT_EQ(filled.alpha.data[i], plain.alpha.data[i]);
      }
    }
  }
}

// How much colour changes from a pixel to the next along rows where a hole ends at the wall, and
// how much beside that.
TEST(PaintedFill, HasNoSeamTowardsTheWall) {
  Model model = panel_model();
  const PaintedView view = painted_at(model, kAside, kPaint);
  const RenderBuffers plain = drawn(model, view.camera);
  model.fill = lift_painted(model, {view}).gaussians;
  const ColorImage shown = picture(with_fill(plain, rasterize(model.fill, view.camera)));
  double at_seam = 0;
  double beside = 0;
  double unblended = 0;
  int count = 0;
  for (int y = 8; y < shown.height - 8; ++y) {
    for (int x = 8; x < shown.width - 8; ++x) {
      const bool ends = is_hole(plain.hole(x, y)) && !is_hole(plain.hole(x + 1, y)) &&
                        plain.median_depth(x + 1, y) > 0.9f * static_cast<float>(kBackWall);
      if (!ends) continue;
      const auto change = [&](int u) { return (shown(u + 1, y) - shown(u, y)).norm(); };
      at_seam += change(x);
      beside += (change(x - 3) + change(x - 2) + change(x - 1)) / 3;
      unblended += (kPaint - shown(x + 1, y)).norm();
      ++count;
    }
  }
  ASSERT_GT(count, 20);
  EXPECT_LT(at_seam, 1.5 * beside);
  EXPECT_LT(at_seam, 0.3 * unblended);
  EXPECT_GT(unblended / count, 0.3);  // there would have been one
}

TEST(PaintedFill, IsWhatWasPaintedAwayFromSeams) {
  Model model = panel_model();
  const PaintedView view = painted_at(model, 2.4, kPaint);
  const RenderBuffers plain = drawn(model, view.camera);
  model.fill = lift_painted(model, {view}).gaussians;
  const ColorImage shown = picture(with_fill(plain, rasterize(model.fill, view.camera)));
  float nearest = 1;
  for (size_t i = 0; i < shown.data.size(); ++i) {
    if (is_hole(plain.hole.data[i])) nearest = std::min(nearest, (shown.data[i] - kPaint).norm());
  }
  EXPECT_LT(nearest, 0.05f);
}

TEST(PaintedFill, TheFirstViewWins) {
  const Model model = panel_model();
  const PaintedView first = painted_at(model, kAside, kPaint);
  const PaintedView second = painted_at(model, kAside + 0.1, {0.9f, 0.9f, 0.1f});
  const PaintedFill alone = lift_painted(model, {second});
  const PaintedFill both = lift_painted(model, {first, second});
  EXPECT_GT(double(both.views[1].filled_before), 0.5 * double(both.views[1].holes));
  EXPECT_LT(double(both.views[1].lifted), 0.5 * double(alone.views[0].lifted));
  ASSERT_EQ(both.gaussians.synthetic_sources.size(), 2u);
  const auto& tags = both.gaussians.synthetic;
  EXPECT_EQ(size_t(std::count(tags.begin(), tags.end(), 2)), both.views[1].lifted);
}

TEST(PaintedFill, HasTheSameBitsForAnyNumberOfThreads) {
  const Model model = panel_model();
  const std::vector<PaintedView> views = {painted_at(model, kAside, kPaint),
                                          painted_at(model, -kAside, kPaint)};
  const auto fill_with = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return lift_painted(model, views).gaussians;
  };
  const Gaussians one = fill_with(1);
  for (const size_t threads : {2, 3, 4}) {
    const Gaussians more = fill_with(threads);
    EXPECT_EQ(more.position, one.position);
    EXPECT_EQ(more.scale, one.scale);
    EXPECT_EQ(more.rotation, one.rotation);
    EXPECT_EQ(more.sh, one.sh);
    EXPECT_EQ(more.synthetic, one.synthetic);
  }
}

TEST(PaintedFill, RefusesWhatFitsNoCamera) {
  const Model model = panel_model();
  PaintedView view = painted_at(model, kAside, kPaint);
  view.picture = ColorImage(3, 2, kPaint);
  EXPECT_THROW(lift_painted(model, {view}), InvalidInput);
  Model bare = model;
  bare.priors.clear();
  EXPECT_THROW(lift_painted(bare, {painted_at(model, kAside, kPaint)}), InvalidInput);
}

}  // namespace
}  // namespace cgs::painted_fill_test
