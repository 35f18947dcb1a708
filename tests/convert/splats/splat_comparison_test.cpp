// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_comparison.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "libcgs/core/error.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/train/image_metrics.h"
#include "tests/support/splat_shapes.h"

namespace cgs::splat_comparison_test {
namespace {

Gaussians ball() {
  Gaussians out;
  test::add_sphere(out, {0, 0, 2}, 0.5, 2000);
  return out;
}

// What lies at x > 0 is gone.
Gaussians half_of(const Gaussians& whole) {
  Gaussians out;
  for (size_t i = 0; i < whole.size(); ++i) {
    if (whole.position[i].x() > 0) continue;
    out.position.push_back(whole.position[i]);
    out.scale.push_back(whole.scale[i]);
    out.rotation.push_back(whole.rotation[i]);
    out.opacity.push_back(whole.opacity[i]);
    out.sh.push_back(whole.sh[i]);
  }
  return out;
}

Camera front() { return {.width = 80, .height = 60, .fx = 80, .fy = 80, .cx = 40, .cy = 30}; }

SplatComparison compared(const Gaussians& a, const Gaussians& b) {
  return compare_splats(a, b, {{"front", front(), {}, {}}}, {}, {});
}

TEST(CompareSplats, FindsNothingBetweenTheSame) {
  const SplatComparison found = compared(ball(), ball());
  EXPECT_TRUE(std::isinf(found.all.psnr.value()));
  EXPECT_EQ(found.all.a.unseen, found.all.b.unseen);
  EXPECT_GT(found.all.a.unseen, 0.1);
  EXPECT_EQ(found.all.a.alone, 0);
  EXPECT_FALSE(found.all.a.psnr.has_value());
  EXPECT_TRUE(lacking_words(found.all).empty());
  const auto json = splat_comparison_to_json(found);
  EXPECT_EQ(json["psnr"], "same");
  EXPECT_EQ(json["views"][0]["name"], "front");
  EXPECT_TRUE(json["a"]["psnr"].is_null());
}

// One side of the ball is open then: to the left of the middle one still looks onto its inside.
TEST(CompareSplats, TellsThatAHalfIsMissing) {
  const SplatComparison found = compared(ball(), half_of(ball()));
  const double shown = 1 - found.all.a.unseen;
  EXPECT_NEAR(found.all.a.alone, shown / 2, 0.1 * shown);
  EXPECT_NEAR(found.all.b.unseen, found.all.a.unseen + found.all.a.alone, 1e-12);
  EXPECT_EQ(found.all.b.alone, 0);
  const auto words = lacking_words(found.all);
  ASSERT_EQ(words.size(), 1u);
  EXPECT_EQ(words[0].rfind("B shows nothing at ", 0), 0u) << words[0];
  const auto turned = lacking_words(compared(half_of(ball()), ball()).all);
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_EQ(turned[0].rfind("A shows nothing at ", 0), 0u) << turned[0];
}

TEST(CompareSplats, MeasuresAgainstThePhotograph) {
  const Gaussians a = ball();
  const Gaussians b = half_of(a);
  ColorImage photograph(80, 60, Eigen::Vector3f(0.2f, 0.4f, 0.6f));
  MaskMap valid(80, 60, 1);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 10; ++x) valid(x, y) = 0;
  }
  const auto load = [&](ComparedView& view) {
    view.photograph = photograph;
    view.valid = valid;
  };
  const SplatComparison found =
      compare_splats(a, b, {{"front", front(), {}, {}}, {"again", front(), {}, {}}}, load, {});
  const RenderBuffers drawn_a = rasterize(a, front());
  const RenderBuffers drawn_b = rasterize(b, front());
  EXPECT_NEAR(found.all.a.psnr.value(), psnr(picture(drawn_a), photograph, &valid), 1e-6);
  EXPECT_NEAR(found.all.b.psnr.value(), psnr(picture(drawn_b), photograph, &valid), 1e-6);
  MaskMap shared = valid;
  for (size_t i = 0; i < shared.data.size(); ++i) {
    const bool is_shown = drawn_a.alpha.data[i] >= 0.5f && drawn_b.alpha.data[i] >= 0.5f;
    if (!is_shown) shared.data[i] = 0;
  }
  EXPECT_NEAR(
      found.views[1].a.psnr_shared.value(), psnr(picture(drawn_a), photograph, &shared), 1e-6);
  photograph = ColorImage(8, 6, Eigen::Vector3f::Zero());
  EXPECT_THROW(compare_splats(a, b, {{"front", front(), {}, {}}}, load, {}), InvalidInput);
}

TEST(CompareSplats, ShowsThemSideBySideWithWhatIsUnseenInMagenta) {
  std::vector<ColorImage> sheets;
  const auto show = [&](const std::string& name, const ColorImage& picture) {
    EXPECT_EQ(name, "front");
    sheets.push_back(picture);
  };
  const Gaussians whole = ball();
  compare_splats(whole, half_of(whole), {{"front", front(), {}, {}}}, {}, show);
  ASSERT_EQ(sheets.size(), 1u);
  ASSERT_GE(sheets[0].width, 3 * 80);
  const auto is_magenta = [](const Eigen::Vector3f& c) { return c.x() > 0.4f && c.y() < 0.4f; };
  const int gap = (sheets[0].width - 3 * 80) / 2;
  const auto at = [&](int tile, int x) { return sheets[0](tile * (80 + gap) + x, 30); };
  EXPECT_FALSE(is_magenta(at(0, 52)));  // of the whole ball right of the middle
  EXPECT_TRUE(is_magenta(at(1, 52)));   // the half ball lacks it
  EXPECT_TRUE(is_magenta(at(2, 52)));
  EXPECT_FALSE(is_magenta(at(1, 28)));
  EXPECT_TRUE(is_magenta(at(0, 2)));
}

TEST(ViewsAround, LookAtTheLargerOfBoth) {
  const Gaussians whole = ball();
  const auto a = views_around(whole, half_of(whole));
  const auto b = views_around(half_of(whole), whole);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GE(a.size(), 8u);
  for (size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].camera.world_from_cam.matrix(), b[k].camera.world_from_cam.matrix());
  }
}

}  // namespace
}  // namespace cgs::splat_comparison_test
