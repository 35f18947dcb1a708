// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/photo_features.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core/utility.hpp>

#include "libcgs/core/error.h"
#include "tests/support/stereo_scene.h"

namespace cgs::photo_features_test {
namespace {

// Round spots on a grey ground, at places that are no multiple of anything.
ColorImage spots(const std::vector<Eigen::Vector2d>& centres, double sigma, int side) {
  ColorImage image(side, side, Eigen::Vector3f::Constant(0.4f));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      double level = 0.4;
      for (const Eigen::Vector2d& c : centres) {
        const double r2 = (Eigen::Vector2d(x + 0.5, y + 0.5) - c).squaredNorm();
        level += 0.5 * std::exp(-r2 / (2 * sigma * sigma));
      }
      image(x, y).setConstant(float(level));
    }
  }
  return image;
}

// Mean offset of the nearest feature from the spots; all but a few must have one.
Eigen::Vector2d mean_offset(const PhotoFeatures& features,
                            const std::vector<Eigen::Vector2d>& centres) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int found = 0;
  for (const Eigen::Vector2d& c : centres) {
    Eigen::Vector2d best = Eigen::Vector2d::Constant(1e9);
    for (const Eigen::Vector2d& p : features.points) {
      if ((p - c).norm() < best.norm()) best = p - c;
    }
    if (best.norm() > 1) continue;
    sum += best;
    ++found;
  }
  EXPECT_GT(found, 0.8 * double(centres.size()));
  return sum / found;
}

std::vector<Eigen::Vector2d> scattered_centres(double step, int side) {
  std::vector<Eigen::Vector2d> centres;
  for (double y = step; y < side - step; y += step) {
    for (double x = step; x < side - step; x += step) {
      centres.emplace_back(x + std::fmod(7.31 * x + 3.7 * y, 1.9),
                           y + std::fmod(5.17 * y + 2.3 * x, 1.7));
    }
  }
  return centres;
}

TEST(PhotoFeatures, LieWherePixelCentresAreAtOneHalf) {
  for (const double sigma : {2.0, 4.0, 7.0}) {
    const auto centres = scattered_centres(9 * sigma, 400);
    const Eigen::Vector2d offset =
        mean_offset(detect_features(spots(centres, sigma, 400)), centres);
    EXPECT_LT(offset.cwiseAbs().maxCoeff(), 0.05) << sigma << ": " << offset.transpose();
  }
}

TEST(PhotoFeatures, OfAShrunkenPhotographAreInItsOwnPixels) {
  const auto centres = scattered_centres(60, 900);
  const PhotoFeatures features = detect_features(spots(centres, 6, 900), {}, {.largest_side = 300});
  EXPECT_EQ(features.pixel, 3);
  EXPECT_LT(mean_offset(features, centres).cwiseAbs().maxCoeff(), 0.15);
}

TEST(PhotoFeatures, AreTheSameForAnyNumberOfThreads) {
  const std::vector<test::TexturedPatch> wall = {
      {{0, 0, 4}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()}};
  const Camera camera = test::looking_at({0, 0, 0}, {0, 0, 4}, 320, 240, 300);
  const ColorImage image = test::photograph(wall, camera, 0.03, 1);
  cv::setNumThreads(1);
  const PhotoFeatures one = detect_features(image, {}, {.most = 200});
  cv::setNumThreads(4);
  const PhotoFeatures four = detect_features(image, {}, {.most = 200});
  ASSERT_EQ(one.points.size(), 200u);
  EXPECT_EQ(one.points, four.points);
  EXPECT_EQ(one.descriptors, four.descriptors);
}

TEST(PhotoFeatures, OfABlankWallAreNone) {
  const ColorImage blank(200, 150, Eigen::Vector3f::Constant(0.7f));
  EXPECT_TRUE(detect_features(blank).points.empty());
  EXPECT_TRUE(match_features(detect_features(blank), detect_features(blank)).empty());
}

TEST(MatchFeatures, FindsWhatASlowSearchFinds) {
  PhotoFeatures a;
  PhotoFeatures b;
  const auto unit_rows = [](int rows, int seed) {
    Eigen::MatrixXf m(rows, 16);
    for (int i = 0; i < rows; ++i) {
      for (int k = 0; k < 16; ++k)
        m(i, k) = float(test::solid_noise({i * 1.0, k * 1.0, seed * 1.0}, 1));
    }
    return m.rowwise().normalized().eval();
  };
  a.descriptors = unit_rows(701, 1);
  b.descriptors = unit_rows(603, 2);
  for (int i = 0; i < 300; ++i) {  // true pairs, disturbed
    b.descriptors.row(i) = (a.descriptors.row(2 * i) + 0.2f * b.descriptors.row(i)).normalized();
  }
  a.points.resize(701);
  b.points.resize(603);
  const auto nearest = [](const auto& from, const auto& in, int i, double ratio) {
    std::vector<std::pair<float, int>> all;
    for (int j = 0; j < in.rows(); ++j) all.emplace_back((from.row(i) - in.row(j)).norm(), j);
    std::sort(all.begin(), all.end());
    return double(all[0].first) < ratio * double(all[1].first) ? all[0].second : -1;
  };
  std::vector<std::pair<int, int>> expected;
  for (int i = 0; i < 700; ++i) {
    const int j = nearest(a.descriptors, b.descriptors, i, 0.8);
    if (j >= 0 && nearest(b.descriptors, a.descriptors, j, 0.8) == i) expected.emplace_back(i, j);
  }
  ASSERT_GT(expected.size(), 50u);
  std::vector<std::pair<int, int>> found;
  for (const FeatureMatch& m : match_features(a, b)) found.emplace_back(m.a, m.b);
  EXPECT_EQ(found, expected);
}

TEST(MatchFeatures, APointOfSeveralLooksIsMatchedOnceAndIsNoRivalOfItself) {
  constexpr int kPoints = 100;
  PhotoFeatures a;
  PhotoFeatures b;
  a.points.resize(kPoints);
  b.points.resize(kPoints);
  a.descriptors.resize(2 * kPoints, 32);
  b.descriptors.resize(kPoints, 32);
  for (int i = 0; i < kPoints; ++i) {
    for (int k = 0; k < 32; ++k) {
      const auto noise = [&](double seed) {
        return float(test::solid_noise({i * 1.0, k * 1.0, seed}, 1)) - 0.5f;
      };
      a.descriptors(2 * i, k) = noise(1) + 0.1f * noise(2);
      a.descriptors(2 * i + 1, k) = noise(1) + 0.1f * noise(3);
      b.descriptors(kPoints - 1 - i, k) = noise(1);
    }
    a.point_of.insert(a.point_of.end(), 2, i);
  }
  a.descriptors.rowwise().normalize();
  b.descriptors.rowwise().normalize();
  const std::vector<FeatureMatch> matches = match_features(a, b);
  ASSERT_EQ(matches.size(), size_t(kPoints));
  for (int i = 0; i < kPoints; ++i) {
    EXPECT_EQ(matches[size_t(i)].a, i);
    EXPECT_EQ(matches[size_t(i)].b, kPoints - 1 - i);
  }
  const std::vector<FeatureMatch> turned = match_features(b, a);
  ASSERT_EQ(turned.size(), size_t(kPoints));
  for (int i = 0; i < kPoints; ++i) EXPECT_EQ(turned[size_t(i)].b, kPoints - 1 - i);
}

// How far each match of two pictures of a wall is off [pixels], ascending.
std::vector<double> errors_on_wall(const std::array<Camera, 2>& cameras,
                                   const std::vector<test::TexturedPatch>& wall,
                                   const std::array<PhotoFeatures, 2>& features) {
  std::vector<double> out;
  for (const FeatureMatch& m : match_features(features[0], features[1])) {
    const Eigen::Vector2d& at = features[0].points[size_t(m.a)];
    const double depth = test::cast(wall, cameras[0], at.x(), at.y()).depth;
    const Eigen::Vector3d there = cameras[1].project(cameras[0].unproject(at.x(), at.y(), depth));
    out.push_back((there.head<2>() - features[1].points[size_t(m.b)]).norm());
  }
  std::sort(out.begin(), out.end());
  return out;
}

size_t within(const std::vector<double>& errors, double most) {
  return size_t(std::lower_bound(errors.begin(), errors.end(), most) - errors.begin());
}

TEST(TiltedFeatures, FindAgainWhatIsSeenFromAside) {
  const std::vector<test::TexturedPatch> wall = {
      {{0, 0, 4}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 1.5, 1.5}};
  const std::array<Camera, 2> cameras = {test::looking_at({0, 0, 0}, {0, 0, 4}, 400, 300, 350),
                                         test::looking_at({3.4, 0, 2}, {0, 0, 4}, 400, 300, 350)};
  std::array<PhotoFeatures, 2> plain;
  std::array<PhotoFeatures, 2> tilted;
  for (const size_t i : {0u, 1u}) {
    const ColorImage image = test::photograph(wall, cameras[i], 0.02);
    plain[i] = detect_features(image);
    tilted[i] = detect_tilted_features(image);
    EXPECT_EQ(tilted[i].point_of.size(), size_t(tilted[i].descriptors.rows()));
    EXPECT_GT(tilted[i].point_of.size(), tilted[i].points.size());
  }
  const std::vector<double> errors_plain = errors_on_wall(cameras, wall, plain);
  const std::vector<double> errors = errors_on_wall(cameras, wall, tilted);
  EXPECT_GT(within(errors, 3), 3 * within(errors_plain, 3));
  EXPECT_GT(within(errors, 3), errors.size() * 9 / 10);
  // Compressing the picture moves what is found in it, each direction another way: 0.64 so.
  EXPECT_LT(errors[errors.size() / 2], 0.45);
}

TEST(TiltedFeatures, AreFoundUpToTheBorder) {
  const std::vector<test::TexturedPatch> wall = {
      {{0, 0, 4}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()}};
  for (const int height : {104, 105, 106, 107}) {
    const Camera camera = test::looking_at({0, 0, 0}, {0, 0, 4}, 160, height, 150);
    const PhotoFeatures features = detect_tilted_features(test::photograph(wall, camera, 0.03, 1));
    EXPECT_GT(features.points.size(), 50u);
    for (const Eigen::Vector2d& p : features.points) {
      EXPECT_TRUE(p.x() > -2 && p.y() > -2 && p.x() < 162 && p.y() < height + 2) << p.transpose();
    }
  }
}

TEST(TiltedFeatures, AreTheSameForAnyNumberOfThreads) {
  const ColorImage image = spots(scattered_centres(23, 300), 3, 300);
  const PhotoFeatures several = detect_tilted_features(image);
  cv::setNumThreads(1);
  const PhotoFeatures single = detect_tilted_features(image);
  cv::setNumThreads(-1);
  EXPECT_EQ(several.points, single.points);
  EXPECT_EQ(several.point_of, single.point_of);
  EXPECT_EQ(several.descriptors, single.descriptors);
}

TEST(FeatureOptions, NameTheFieldOutOfRange) {
  EXPECT_THROW(FeatureOptions{.largest_side = 10}.validate(), InvalidInput);
  EXPECT_THROW(FeatureOptions{.most = 0}.validate(), InvalidInput);
}

TEST(PhotoFeatures, LieWhereTheMaskLetsThem) {
  const std::vector<Eigen::Vector2d> centres = {{60, 60}, {60, 200}, {200, 60}, {200, 200}};
  const ColorImage image = spots(centres, 6, 260);
  MaskMap left(image.width, image.height, 0);
  for (int y = 0; y < left.height; ++y) {
    for (int x = 0; x < left.width / 2; ++x) left(x, y) = 1;
  }
  const PhotoFeatures all = detect_features(image);
  const PhotoFeatures some = detect_features(image, left);
  EXPECT_GT(some.points.size(), 1u);
  EXPECT_LT(some.points.size(), all.points.size());
  for (const Eigen::Vector2d& p : some.points) EXPECT_LT(p.x(), image.width / 2 + 1);
}

}  // namespace
}  // namespace cgs::photo_features_test
