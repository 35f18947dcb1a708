// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/virtual_view.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/planted_training.h"

namespace cgs::virtual_view_test {
namespace {

struct TwoViews {
  TrainingView first, second;
  std::vector<PixelMatch> matches;
};

TwoViews two_views() {
  const test::PlantedScene planted = test::planted_scene(0);
  const auto view = [&](size_t n) {
    return training_view(planted.scene.views[n], planted.priors[n]);
  };
  return {view(0),
          view(2),
          pixel_matches(planted.scene.views[0].camera,
                        planted.priors[0],
                        planted.scene.views[2].camera,
                        planted.priors[2])};
}

// Against a photograph from there, also where the box hides the wall from one of the two.
TEST(VirtualView, ShowsWhatAPhotographFromThereWould) {
  const TwoViews views = two_views();
  for (const double share : {0.3, 0.5, 0.7}) {
    const VirtualView seen = virtual_view(views.first, views.second, views.matches, share);
    const ColorImage truth = test::photograph(test::wall_and_box(), seen.camera, 0.02);
    double sum = 0;
    size_t count = 0;
    size_t wrong = 0;
    for (size_t i = 0; i < truth.data.size(); ++i) {
      if (seen.use.data[i] == 0) continue;
      const double error = std::abs(double(seen.photograph[0].data[i]) - double(truth.data[i].x()));
      sum += error;
      wrong += error > 0.2;
      ++count;
    }
    EXPECT_GT(double(count), 0.4 * double(truth.data.size())) << share;
    EXPECT_LT(sum / double(count), 0.03) << share;
    EXPECT_LT(double(wrong), 0.01 * double(count)) << share;
  }
}

TEST(VirtualView, KnowsNothingWithoutMatchesAndOfMaskedPixels) {
  TwoViews views = two_views();
  const auto known = [&](std::span<const PixelMatch> matches) {
    size_t sum = 0;
    for (const uint8_t use : virtual_view(views.first, views.second, matches, 0.5).use.data) {
      sum += use;
    }
    return sum;
  };
  EXPECT_EQ(known({}), 0u);
  EXPECT_GT(known(views.matches), 0u);
  views.second.use = MaskMap(views.second.camera.width, views.second.camera.height, 0);
  EXPECT_EQ(known(views.matches), 0u);
}

TEST(VirtualView, RefusesAShareThatIsNone) {
  const TwoViews views = two_views();
  EXPECT_THROW(virtual_view(views.first, views.second, views.matches, 1.5), InvalidInput);
  EXPECT_THROW(virtual_view(views.first, views.second, views.matches, NAN), InvalidInput);
}

}  // namespace
}  // namespace cgs::virtual_view_test
