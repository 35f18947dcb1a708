// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/exposure.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"
#include "tests/support/textured_cube.h"

namespace cgs::exposure_test {
namespace {

using Eigen::Vector3f;

const Eigen::AlignedBox3d kBox(Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2));

std::vector<View> photographs() {
  return {test::photograph("a", test::camera_at({-0.4, 0.3, -1.1}), {kBox}),
          test::photograph("b", test::camera_at({0.0, 0.35, -1.2}), {kBox}),
          test::photograph("c", test::camera_at({0.5, 0.3, -1.0}), {kBox})};
}

ExposureGains estimated(const std::vector<View>& views) {
  const TriangleMesh mesh = test::box(40);
  std::vector<std::pair<size_t, size_t>> all;
  for (size_t a = 0; a < views.size(); ++a) {
    for (size_t b = a + 1; b < views.size(); ++b) all.emplace_back(a, b);
  }
  return exposure_gains(mesh, face_scores(mesh, views), views, all);
}

TEST(ExposureGains, FindPlantedGains) {
  std::vector<View> views = photographs();
  const std::array<Vector3f, 3> planted = {
      Vector3f(1.25f, 1.1f, 0.8f), Vector3f(0.9f, 1.0f, 1.0f), Vector3f(0.7f, 0.95f, 1.2f)};
  Vector3f mean = Vector3f::Zero();  // of the logarithms
  for (size_t v = 0; v < 3; ++v) {
    apply_gain(views[v].image, planted.at(v));
    mean += planted.at(v).array().log().matrix() / 3;
  }
  const ExposureGains found = estimated(views);
  for (size_t v = 0; v < 3; ++v) {
    const Vector3f expected = (mean.array() - planted.at(v).array().log()).exp();
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.gain[v][c] / expected[c], 1, 0.005) << v << c;
    EXPECT_GT(found.samples[v], 1000u);
  }
}

TEST(ExposureGains, AreNotMisledByAThirdOfAPicture) {
  std::vector<View> views = photographs();
  for (int y = 0; y < 240; ++y) {  // a highlight that only one camera sees
    for (int x = 110; x < 150; ++x) views[1].image(x, y) *= 1.2f;
  }
  const ExposureGains found = estimated(views);
  for (size_t v = 0; v < 3; ++v) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.gain[v][c], 1, 0.01) << v << c;
  }
}

TEST(ExposureGains, LeaveUniformPicturesAndLonelyViewsAsTheyAre) {
  std::vector<View> views = photographs();
  for (View& view : views) {
    view.image = ColorImage(320, 240, Vector3f::Constant(128.0f / 255.0f));
  }
  views[2].camera = test::camera_at({0, 0, 1.5});  // shares nothing with the others
  views[2].image = ColorImage(320, 240, Vector3f::Constant(0.9f));
  const ExposureGains found = estimated(views);
  for (const Vector3f& gain : found.gain) EXPECT_EQ(gain, Vector3f::Ones());
  EXPECT_EQ(found.samples[2], 0u);
  EXPECT_GT(found.samples[0], 100u);
}

TEST(ExposureGains, NeedTheImages) {
  std::vector<View> views = photographs();
  views[1].image = {};
  EXPECT_THROW(estimated(views), InvalidInput);
}

TEST(ApplyGain, MultipliesLinearLightAndKeepsEveryBitAtOne) {
  ColorImage image(1, 2, Vector3f(0.2f, 0.5f, 0.9f));
  const ColorImage before = image;
  apply_gain(image, Vector3f::Ones());
  EXPECT_EQ(image.data[0], before.data[0]);
  apply_gain(image, {2, 1, 0.5f});
  EXPECT_NEAR(linear_from_srgb(image.data[1].x()), 2 * linear_from_srgb(0.2f), 1e-6);
  EXPECT_EQ(image.data[1].y(), 0.5f);
  EXPECT_NEAR(linear_from_srgb(image.data[1].z()), 0.5 * linear_from_srgb(0.9f), 1e-6);
}

}  // namespace
}  // namespace cgs::exposure_test
