// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/density_control.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/sample_splats.h"

namespace cgs::density_control_test {
namespace {

constexpr uint64_t kSeed = 5;

void expect_same_splat(const Gaussians& a, size_t i, const Gaussians& b, size_t j) {
  EXPECT_EQ(a.position[i], b.position[j]);
  EXPECT_EQ(a.scale[i], b.scale[j]);
  EXPECT_EQ(a.rotation[i], b.rotation[j]);
  EXPECT_EQ(a.opacity[i], b.opacity[j]);
  const auto count = static_cast<size_t>(a.sh_count());
  for (size_t k = 0; k < count; ++k) EXPECT_EQ(a.sh[i * count + k], b.sh[j * count + k]);
}

TEST(DensityChanges, FollowTheGradientTheScaleAndTheOpacity) {
  Gaussians g = test::varied_splats(5, 0);
  for (Eigen::Vector3f& s : g.scale) s = {0.01f, 0.02f, 0.01f};
  std::fill(g.opacity.begin(), g.opacity.end(), 0.5f);
  g.opacity[1] = 0.004f;
  g.scale[3] = {0.01f, 0.01f, 0.06f};
  g.scale[4] = {0.01f, 0.3f, 0.01f};
  const DensityOptions options = {.split_above = 0.05f, .largest = 0.2f};
  const auto changes = density_changes(g, {3e-4f, 3e-4f, 1e-4f, 3e-4f, 0}, options);
  using enum DensityChange;
  EXPECT_EQ(changes, (std::vector<DensityChange>{Clone, Prune, Keep, Split, Prune}));
  EXPECT_THROW(density_changes(g, {1}, options), InvalidInput);
}

TEST(DensityChanges, AddsThoseOfTheLargestGradientWhereRoomIsShort) {
  Gaussians g = test::varied_splats(6, 0);
  std::fill(g.opacity.begin(), g.opacity.end(), 0.5f);
  g.opacity[0] = 0;  // goes, and leaves a place
  const DensityOptions options = {.split_above = 10, .most = 7};
  const auto changes = density_changes(g, {1, 0.1f, 0.4f, 0.3f, 0, 0.4f}, options);
  using enum DensityChange;
  EXPECT_EQ(changes, (std::vector<DensityChange>{Prune, Keep, Clone, Keep, Keep, Clone}));
  EXPECT_EQ(changed_density(g, changes, kSeed).gaussians.size(), 7u);
}

TEST(ChangedDensity, KeepsTheBitsOfWhatStaysAndCopiesWhatIsCloned) {
  using enum DensityChange;
  Gaussians g = test::varied_splats(4, 2);
  g.provenance.assign(4, Provenance::Observed);
  const ChangedDensity out = changed_density(g, {Keep, Prune, Clone, Keep}, kSeed);
  ASSERT_EQ(out.gaussians.size(), 4u);
  EXPECT_EQ(out.gaussians.sh_degree, 2);
  EXPECT_EQ(out.came_from, (std::vector<uint32_t>{0, 2, 3, ChangedDensity::kNone}));
  for (const auto& [now, before] : {std::pair{0, 0}, {1, 2}, {2, 3}, {3, 2}}) {
    expect_same_splat(out.gaussians, size_t(now), g, size_t(before));
  }
  EXPECT_TRUE(out.gaussians.provenance.empty());
}

// Many splits of one splat: their places have its mean and its covariance.
TEST(ChangedDensity, SplitsByTheDistributionOfTheSplat) {
  const Gaussians one = test::varied_splats(1, 1);
  Gaussians g;
  g.sh_degree = 1;
  constexpr size_t kCount = 20'000;
  for (size_t i = 0; i < kCount; ++i) {
    g.position.push_back(one.position[0]);
    g.scale.emplace_back(0.01f, 0.02f, 0.03f);
    g.rotation.push_back(one.rotation[0]);
    g.opacity.push_back(one.opacity[0]);
    g.sh.insert(g.sh.end(), one.sh.begin(), one.sh.end());
  }
  const std::vector<DensityChange> changes(kCount, DensityChange::Split);
  const ChangedDensity out = changed_density(g, changes, kSeed);
  ASSERT_EQ(out.gaussians.size(), 2 * kCount);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < out.gaussians.size(); ++i) {
    const Eigen::Vector3d off = (out.gaussians.position[i] - g.position[0]).cast<double>();
    mean += off / (2.0 * kCount);
    spread += off * off.transpose() / (2.0 * kCount);
    ASSERT_EQ(out.came_from[i], ChangedDensity::kNone);
    ASSERT_TRUE(out.gaussians.scale[i].isApprox(g.scale[0] / 1.6f, 1e-6f));
    ASSERT_EQ(out.gaussians.opacity[i], g.opacity[0]);
    ASSERT_EQ(out.gaussians.rotation[i], g.rotation[0]);
    ASSERT_EQ(out.gaussians.sh[4 * i + 3], g.sh[3]);
  }
  EXPECT_LT(mean.norm(), 5 * 0.03 / std::sqrt(2.0 * kCount));
  const Eigen::Matrix3d expected = covariance(g.scale[0], g.rotation[0]).cast<double>();
  EXPECT_LT((spread - expected).norm(), 0.05 * expected.norm());
}

TEST(ChangedDensity, DependsOnTheSeedAlone) {
  const Gaussians g = test::varied_splats(50, 0);
  const std::vector<DensityChange> changes(50, DensityChange::Split);
  const auto places = [&](uint64_t seed) {
    return changed_density(g, changes, seed).gaussians.position;
  };
  EXPECT_EQ(places(1), places(1));
  EXPECT_NE(places(1), places(2));
  const auto once = places(1);
  for (size_t i = 0; i + 1 < once.size(); i += 2) EXPECT_NE(once[i], once[i + 1]);
}

}  // namespace
}  // namespace cgs::density_control_test
