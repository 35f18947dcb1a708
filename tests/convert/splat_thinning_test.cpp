// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splat_thinning.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "convert/model.h"
#include "convert/splat_refit.h"
#include "convert/splat_selection.h"
#include "libcgs/core/error.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {
namespace {

constexpr int kSide = 64;
constexpr int kMargin = 16;  // the wall goes on beyond the photographs
constexpr double kPixel = 1.0 / kSide;

/// A wall at depth 1 with smooth colours, and three photographs of it, each with a
/// splat per pixel.
class ThinSplatsTest : public testing::Test {
 protected:
  ThinSplatsTest() {
    for (int n = 0; n < 3; ++n) {
      View view;
      view.name = std::to_string(n);
      view.camera.width = view.camera.height = kSide;
      view.camera.fx = view.camera.fy = 1 / kPixel;
      view.camera.cx = view.camera.cy = 0.5 * kSide;
      // Not whole pixels apart: splats of different views lie between each other.
      view.camera.world_from_cam.translation() = Eigen::Vector3d(0.0621 * (n - 1), 0.0173 * n, 0);
      photograph(view, n);
      scene_.input.push_back(n);
      scene_.views.push_back(view);
    }
  }

  void photograph(View& view, int n) {
    view.image = ColorImage(kSide, kSide, Eigen::Vector3f::Zero());
    for (int y = -kMargin; y < kSide + kMargin; ++y) {
      for (int x = -kMargin; x < kSide + kMargin; ++x) {
        const Eigen::Vector3d p = view.camera.unproject(x + 0.5, y + 0.5, 1);
        const Eigen::Vector3f color = wall_color(p);
        add(p, color);
        if (!view.image.contains(x, y)) continue;
        // Noise, another one in each photograph, so that these tell as little as real ones do.
        const auto noise = static_cast<float>(0.3 * std::sin(12.9898 * x + 78.233 * y + 37.7 * n));
        view.image(x, y) = color + Eigen::Vector3f::Constant(noise);
      }
    }
  }

  static Eigen::Vector3f wall_color(const Eigen::Vector3d& p) {
    return Eigen::Vector3d(0.4 + 0.1 * std::sin(5 * p.x()), 0.4, 0.4 + 0.1 * std::cos(4 * p.y()))
        .cast<float>();
  }

  void add(const Eigen::Vector3d& p, const Eigen::Vector3f& color) {
    splats_.position.push_back(p.cast<float>());
    splats_.scale.emplace_back(
        Eigen::Vector3d(0.5 * kPixel, 0.5 * kPixel, 0.15 * kPixel).cast<float>());
    splats_.rotation.emplace_back(1.0f, 0.0f, 0.0f, 0.0f);
    splats_.opacity.push_back(0.6f);
    splats_.sh.push_back((color - Eigen::Vector3f::Constant(0.5f)) / kShC0);
  }

  ThinnedSplats thinned() const { return thin_splats(splats_, scene_, counts_); }

  Scene scene_;
  Gaussians splats_;
  std::vector<size_t> counts_ =
      std::vector<size_t>(3, size_t{kSide + 2 * kMargin} * size_t{kSide + 2 * kMargin});
};

TEST_F(ThinSplatsTest, NeedsFarFewerForAWall) {
  const ThinnedSplats out = thinned();
  ASSERT_TRUE(out.most_cost.has_value()) << thinning_to_json(out, splats_.size());
  EXPECT_LT(out.splats.size(), splats_.size() / 3);
  const auto chosen = std::find_if(out.tried.begin(), out.tried.end(), [&](const auto& t) {
    return t.most_cost == *out.most_cost;
  });
  ASSERT_NE(chosen, out.tried.end());
  EXPECT_LE(chosen->loss, kMostThinningLoss);
  EXPECT_EQ(chosen->splats, out.splats.size());
}

TEST_F(ThinSplatsTest, ChoosesAndGivesTheSameForAnyNumberOfThreads) {
  const ThinnedSplats first = thinned();
  for (const size_t threads : {size_t{1}, size_t{4}}) {
    const tbb::global_control some(tbb::global_control::max_allowed_parallelism, threads);
    const ThinnedSplats again = thinned();
    EXPECT_EQ(first.most_cost, again.most_cost);
    EXPECT_EQ(first.splats.position, again.splats.position);
    EXPECT_EQ(first.splats.opacity, again.splats.opacity);
    EXPECT_EQ(first.splats.sh, again.splats.sh);
  }
}

// Splats that show each other's photographs without any error leave no room for one.
TEST_F(ThinSplatsTest, KeepsAllWhereAnyLossWouldShow) {
  const Gaussians one = splats_;
  scene_.views.resize(2);
  scene_.input = {0, 1};
  scene_.views[1].camera = scene_.views[0].camera;
  const size_t own = counts_[0];
  std::vector<uint8_t> keep(one.size(), 0);
  std::fill_n(keep.begin(), own, uint8_t{1});
  keep_only(splats_, keep);
  for (size_t i = 0; i < own; ++i) {  // colours that cannot be merged without a trace
    splats_.sh[i] *= static_cast<float>(1 + 0.5 * std::sin(double(i * i)));
  }
  const ColorImage shown = picture(rasterize(splats_, scene_.views[0].camera));
  for (View& view : scene_.views) view.image = shown;
  const Gaussians first = splats_;
  for (size_t i = 0; i < own; ++i) {  // the second layer shows the same
    splats_.position.push_back(first.position[i]);
    splats_.scale.push_back(first.scale[i]);
    splats_.rotation.push_back(first.rotation[i]);
    splats_.opacity.push_back(first.opacity[i]);
    splats_.sh.push_back(first.sh[i]);
  }
  counts_ = {own, own};
  const ThinnedSplats out = thinned();
  EXPECT_FALSE(out.most_cost.has_value()) << thinning_to_json(out, splats_.size());
  EXPECT_EQ(out.splats.position, splats_.position);
  EXPECT_FALSE(out.tried.empty());
}

TEST_F(ThinSplatsTest, LeavesSplatsAloneThatAreNotOfTheViews) {
  counts_[2] -= 1;
  const ThinnedSplats out = thinned();
  EXPECT_EQ(out.splats.position, splats_.position);
  EXPECT_TRUE(out.tried.empty());
  EXPECT_TRUE(thinning_to_json(out, splats_.size())["chosen"].is_null());
}

TEST_F(ThinSplatsTest, NamesWhatItTried) {
  ThinnedSplats out;
  out.splats.position.resize(7);
  out.tried = {{0.001f, 7, 0.02}};
  out.most_cost = 0.001f;
  const nlohmann::ordered_json json = thinning_to_json(out, 9);
  EXPECT_EQ(json["kept"], 7);
  EXPECT_EQ(json["of"], 9);
  EXPECT_EQ(json["chosen"], 0.001);
  EXPECT_EQ(json["tried"][0]["most_cost"], 0.001);
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
  const auto wanted = pictures_to_match(splats_, std::vector{scene_.views[0].camera});
  Gaussians changed = splats_;
  for (float& o : changed.opacity) o = 0.4f;
  for (Eigen::Vector3f& c : changed.sh) c += Eigen::Vector3f::Constant(0.05f);
  const double before = off_by(changed, wanted[0]);
  const std::vector<float> pixel(changed.size(), static_cast<float>(kPixel));
  refit_splats(changed, pixel, wanted, 24);
  EXPECT_LT(off_by(changed, wanted[0]), 0.3 * before);
  EXPECT_THROW(refit_splats(changed, pixel, {}, 1), InvalidInput);
}

}  // namespace
}  // namespace cgs
