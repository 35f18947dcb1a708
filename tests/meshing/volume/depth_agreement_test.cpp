// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/depth_agreement.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "convert/run/stage_cost.h"
#include "io/bytes/sanitized.h"

namespace cgs::depth_agreement_test {
namespace {

constexpr int kWidth = 1200;
constexpr int kHeight = 900;

// Side by side before a wall, each a little farther from the one before, so that every factor has
// other partners.
std::vector<Camera> cameras_before_a_wall(size_t count) {
  std::vector<Camera> out;
  for (size_t k = 0; k < count; ++k) {
    Camera camera;
    camera.width = kWidth;
    camera.height = kHeight;
    camera.fx = camera.fy = 400;
    camera.cx = 0.5 * kWidth;
    camera.cy = 0.5 * kHeight;
    camera.world_from_cam.translation().x() = 0.0005 * std::pow(1.3, k);
    out.push_back(camera);
  }
  return out;
}

TEST(DepthAgreement, KeepsNoFramesOfFullSize) {
  const std::vector<Camera> cameras = cameras_before_a_wall(60);
  std::set<size_t> asked_for;
  const CostMeter meter;
  const size_t before = meter.read().peak_memory;
  const DepthAgreement found = depth_agreement(cameras, [&](size_t i) {
    asked_for.insert(i);
    TsdfView view;
    view.camera = cameras[i];
    view.depth = DepthMap(kWidth, kHeight, 1.0f);
    return view;
  });
  const size_t peak = meter.read().peak_memory;
  EXPECT_NEAR(found.off, 0, 1e-6);
  EXPECT_EQ(found.best_factor, 1);
  EXPECT_FALSE(found.shows_scale);  // a wall agrees with depth of any unit
  EXPECT_GE(asked_for.size(), 30U);
  if (before == 0) GTEST_SKIP() << "this system does not let a process reset its peak";
  if (kIsSanitized) GTEST_SKIP() << "AddressSanitizer keeps what was given back";
  EXPECT_LT(peak - before, 15 * sizeof(float) * kWidth * kHeight);
}

}  // namespace
}  // namespace cgs::depth_agreement_test
