// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/exposure.h"

#include <gtest/gtest.h>

#include "libcgs/core/srgb.h"

namespace cgs::core_exposure_test {
namespace {

using Eigen::Vector3f;

ColorImage gradient() {
  ColorImage image(40, 30, Vector3f::Zero());
  for (size_t i = 0; i < image.data.size(); ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(image.data.size());
    image.data[i] = Vector3f(0.2f + 0.5f * t, 0.6f - 0.3f * t, 0.3f);
  }
  return image;
}

TEST(MatchingGain, IsFoundFromThePixelsOfUseThatAreNotClipped) {
  const ColorImage wanted = gradient();
  ColorImage dark = wanted;
  apply_gain(dark, {0.5f, 0.8f, 0.64f});
  MaskMap use(40, 30, 1);
  for (size_t i = 0; i < 300; ++i) {  // what the other one does not show
    dark.data[i] = Vector3f::Constant(0.5f);
    use.data[i] = 0;
  }
  for (size_t i = 300; i < 850; ++i) dark.data[i] = Vector3f::Ones();
  const Vector3f gain = matching_gain(dark, wanted, use);
  EXPECT_LT((gain - Vector3f(2, 1.25f, 1 / 0.64f)).norm(), 1e-4f);
  use = MaskMap(40, 30, 0);
  EXPECT_EQ(matching_gain(dark, wanted, use), Vector3f::Ones());
}

TEST(ApplyExposure, MakesNothingBrighterThanWhite) {
  View view;
  view.image = gradient();
  const ColorImage before = view.image;
  apply_exposure(view);
  EXPECT_EQ(view.image.data, before.data);
  view.exposure = {4, 1, 0.5f};
  apply_exposure(view);
  EXPECT_EQ(view.image.data.back().x(), 1);
  EXPECT_EQ(view.image.data.back().y(), before.data.back().y());
  EXPECT_NEAR(linear_from_srgb(view.image.data[0].z()), 0.5 * linear_from_srgb(0.3f), 1e-6);
}

}  // namespace
}  // namespace cgs::core_exposure_test
