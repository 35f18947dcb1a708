// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/picture_terms.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <gtest/gtest.h>

#include "tests/support/loss_checks.h"

namespace cgs::picture_terms_test {
namespace {

constexpr int kWidth = 24;
constexpr int kHeight = 17;

TrainingView view_of(bool is_grey) {
  TrainingView out;
  out.camera.width = kWidth;
  out.camera.height = kHeight;
  out.photograph = test::noise_planes(kWidth, kHeight, 1);
  out.is_grey = is_grey;
  if (is_grey) out.photograph[1] = out.photograph[2] = out.photograph[0];
  return out;
}

TrainingBuffers drawn() {
  TrainingBuffers out;
  // Away from black, where the curve of sRGB has its kink.
  for (unsigned c = 0; c < 3; ++c) {
    out.color[c] = test::noise_raster(kWidth, kHeight, 20 + c, 0.2f, 0.9f);
  }
  out.alpha = Raster<float>(kWidth, kHeight, 1);
  return out;
}

double add_terms(const TrainingBuffers& rendered,
                 const TrainingView& view,
                 const TrainingOptions& options,
                 TrainingBuffers& loss) {
  StepReport report;
  add_picture_terms(rendered,
                    view,
                    {.options = options, .share = 0.5, .time = 0, .disparity_unit = 1},
                    loss,
                    report);
  return report.l1 + report.ssim;
}

TEST(PictureTerms, AddToTheDerivativesTheyAreGiven) {
  for (const bool is_grey : {false, true}) {
    TrainingBuffers fresh;
    add_terms(drawn(), view_of(is_grey), {}, fresh);
    TrainingBuffers loss;
    loss.color = test::noise_planes(kWidth, kHeight, 7);
    const ColorPlanes before = loss.color;
    add_terms(drawn(), view_of(is_grey), {}, loss);
    for (size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(fresh.color[c].data.size(), before[c].data.size());
      for (size_t i = 0; i < before[c].data.size(); ++i) {
        const float sum = before[c].data[i] + fresh.color[c].data[i];
        ASSERT_NEAR(loss.color[c].data[i], sum, 1e-6f) << c << ", grey " << is_grey;
      }
    }
  }
}

// Along the derivative itself, where the term changes most.
TEST(PictureTerms, OfAGreyPhotographAreDifferentiatedThroughTheLuminance) {
  TrainingOptions options;
  options.l1_weight = 0;  // has kinks everywhere
  options.ssim_weight = 1;
  const TrainingView view = view_of(true);
  TrainingBuffers loss;
  add_terms(drawn(), view, options, loss);
  double squares = 0;
  double largest = 0;
  for (const Raster<float>& plane : loss.color) {
    for (const float d : plane.data) {
      squares += double(d) * double(d);
      largest = std::max(largest, std::abs(double(d)));
    }
  }
  ASSERT_GT(squares, 0);
  const double step = 2e-3 / largest;
  const auto value_at = [&](double way) {
    TrainingBuffers moved = drawn();
    for (size_t c = 0; c < 3; ++c) {
      for (size_t i = 0; i < moved.color[c].data.size(); ++i) {
        moved.color[c].data[i] += static_cast<float>(way * double(loss.color[c].data[i]));
      }
    }
    TrainingBuffers ignored;
    return add_terms(moved, view, options, ignored);
  };
  EXPECT_NEAR((value_at(step) - value_at(-step)) / (2 * step), squares, 0.01 * squares);
}

TEST(PictureTerms, OfNoWeightTouchNothing) {
  TrainingOptions options;
  options.l1_weight = 0;
  options.ssim_weight = 0;
  for (const bool is_grey : {false, true}) {
    TrainingBuffers loss;
    EXPECT_EQ(add_terms(drawn(), view_of(is_grey), options, loss), 0);
    for (const Raster<float>& plane : loss.color) EXPECT_TRUE(plane.empty());
  }
}

}  // namespace
}  // namespace cgs::picture_terms_test
