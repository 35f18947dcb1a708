// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/changes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace cgs::changes_test {
namespace {

constexpr int kSide = 160;        // vertices
constexpr double kStep = 0.0125;  // so that the sheet is 2 wide

// A sheet over the x-y plane that looks up, observed with a sigma.
MeasurableMesh sheet(const std::function<double(double, double)>& height,
                     float sigma,
                     double scatter = 0,
                     unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  MeasurableMesh out;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const double x = kStep * (i - kSide / 2);
      const double y = kStep * (j - kSide / 2);
      out.points.emplace_back(x, y, height(x, y) + scatter * noise(random));
      out.mesh.vertices.push_back(out.points.back().cast<float>());
      out.mesh.sigma.push_back(sigma);
    }
  }
  const auto at = [](int i, int j) { return static_cast<uint32_t>(j * kSide + i); };
  for (int j = 0; j + 1 < kSide; ++j) {
    for (int i = 0; i + 1 < kSide; ++i) {
      out.mesh.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      out.mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  out.mesh.provenance.assign(out.mesh.faces.size(), Provenance::Observed);
  return out;
}

double flat(double, double) { return 0; }

// A round plateau of 0.02 with a rim, at (0.4, 0).
double plateau(double x, double y) {
  const double t = std::clamp((0.3 - std::hypot(x - 0.4, y)) / 0.08, 0.0, 1.0);
  return 0.02 * t * t * (3 - 2 * t);
}

double volume_under(const std::function<double(double, double)>& height) {
  constexpr double kFine = 0.001;
  double sum = 0;
  for (double x = -1; x < 1; x += kFine) {
    for (double y = -1; y < 1; y += kFine) sum += height(x, y) * kFine * kFine;
  }
  return sum;
}

TEST(StandingOut, TellsWhereAndHowMuchWasGained) {
  const Changes changes = standing_out(sheet(plateau, 0.001F), sheet(flat, 0.001F));
  ASSERT_EQ(changes.patches.size(), 1U);
  const ChangePatch& patch = changes.patches.front();
  EXPECT_LT((patch.center - Eigen::Vector3d(0.4, 0, 0.018)).norm(), 0.01);
  ASSERT_TRUE(patch.volume);
  const double truth = volume_under(plateau);
  EXPECT_NEAR(*patch.volume, truth, 0.05 * truth);
  // Alike within the patch: sigma of the distance times its area.
  EXPECT_NEAR(patch.volume_sigma, patch.area * std::hypot(0.001, 0.001), 0.1 * patch.volume_sigma);
  EXPECT_EQ(changes.noise, 1);
  EXPECT_GT(changes.comparable, 0.9);
  size_t in_patch = 0;
  for (const int number : changes.patch_of_face) in_patch += number == 0 ? 1 : 0;
  EXPECT_NEAR(double(in_patch) * 0.5 * kStep * kStep, patch.area, 0.05 * patch.area);
}

TEST(StandingOut, FindsNothingWhereTheOtherStandsOut) {
  EXPECT_TRUE(standing_out(sheet(flat, 0.001F), sheet(plateau, 0.001F)).patches.empty());
}

TEST(StandingOut, FindsNothingInWhatIsUncertain) {
  EXPECT_TRUE(standing_out(sheet(plateau, 0.02F), sheet(flat, 0.02F)).patches.empty());
}

// Sigma claims a tenth of what surfaces scatter by, each in swells of its own: that is seen in all
// the surface that did not change.
TEST(StandingOut, BelievesTheScatterOfTheSurfaceOverItsSigma) {
  const auto swell = [](double phase) {
    return [phase](double x, double y) {
      return 0.004 * std::sin(9 * x + phase) * std::cos(11 * y + phase);
    };
  };
  const Changes changes = standing_out(sheet(swell(0), 0.0003F), sheet(swell(2), 0.0003F));
  EXPECT_GT(changes.noise, 5);
  EXPECT_TRUE(changes.patches.empty());
}

// A hill that is larger by half of what the scale may be wrong by has not grown.
TEST(StandingOut, FindsNothingInAnErrorOfTheScale) {
  const auto hill = [](double x, double y) {
    return 0.4 * std::exp(-(x * x + y * y) / (2 * 0.2 * 0.2));
  };
  const MeasurableMesh before = sheet(hill, 0.001F);
  MeasurableMesh after = before;
  for (size_t v = 0; v < after.points.size(); ++v) {
    after.points[v] *= 1.02;
    after.mesh.vertices[v] = after.points[v].cast<float>();
  }
  EXPECT_FALSE(standing_out(after, before).patches.empty());  // of one scale, it has
  M3c2Request request;
  request.scale_sigma = 0.04;
  EXPECT_TRUE(standing_out(after, before, request).patches.empty());
  EXPECT_TRUE(standing_out(before, after, request).patches.empty());
}

// A plate in the air: the sides of what carries it were not seen.
TEST(StandingOut, TellsNoVolumeOfWhatStandsFree) {
  const auto plate = [](double x, double y) {
    return std::max(std::abs(x), std::abs(y)) < 0.1 ? 0.5 : 0.0;
  };
  MeasurableMesh after = sheet(plate, 0.001F);
  std::erase_if(after.mesh.faces, [&](const auto& face) {
    return after.points[face[0]].z() != after.points[face[1]].z() ||
           after.points[face[0]].z() != after.points[face[2]].z();
  });
  after.mesh.provenance.resize(after.mesh.faces.size());
  const Changes changes = standing_out(after, sheet(flat, 0.001F));
  size_t free = 0;
  for (const ChangePatch& patch : changes.patches) {
    if (patch.distance <= std::sqrt(patch.area)) continue;
    ++free;
    EXPECT_FALSE(patch.volume);
  }
  EXPECT_GT(free, 0U);
  const ChangeTotal total = total_of(changes.patches);
  EXPECT_LT(total.volume, 0.1 * (0.5 * 0.2 * 0.2));
}

TEST(TotalOf, AddsVolumesAndSquaresOfSigmas) {
  ChangePatch known{.area = 2, .volume = 3, .volume_sigma = 0.3};
  ChangePatch other{.area = 1, .volume = 1, .volume_sigma = 0.4};
  ChangePatch free{.area = 5};
  const ChangeTotal total = total_of({free, known, other});
  EXPECT_EQ(total.area, 8);
  EXPECT_EQ(total.volume, 4);
  EXPECT_NEAR(total.volume_sigma, 0.5, 1e-12);
  EXPECT_EQ(total.without_volume, 1U);
}

}  // namespace
}  // namespace cgs::changes_test
