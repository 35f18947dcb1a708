// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/control_fit.h"

#include <cmath>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/remedy_of_refusal.h"

namespace cgs::control_fit_test {
namespace {

const Eigen::Vector3d kUtm(512'345.678, 5'403'210.123, 287.456);

Similarity planted(const Eigen::Vector3d& place = kUtm) {
  Similarity out;
  out.scale = 3.7;
  out.rotation =
      Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  out.from = {0.3, -0.2, 4};
  out.to = place;
  return out;
}

std::vector<Eigen::Vector3d> corners() {
  return {{-1, -1, 4},
          {1.2, -0.8, 5},
          {1, 1, 4.4},
          {-1.1, 0.9, 5.2},
          {0.1, 0, 3.8},
          {0.4, -0.7, 5.6},
          {-0.6, 0.2, 4.9},
          {0.8, 0.3, 3.9}};
}

// Deeper than wide, as photographs measure.
Eigen::Matrix3d ellipsoid(double size) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
  return size * size * R * Eigen::Vector3d(1, 1, 25).asDiagonal() * R.transpose();
}

class Noise {
 public:
  explicit Noise(unsigned seed) : random_(seed) {}
  Eigen::Vector3d operator()(const Eigen::Matrix3d& covariance) {
    const Eigen::Vector3d white(normal_(random_), normal_(random_), normal_(random_));
    return covariance.llt().matrixL() * white;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// The first points of corners(), measured with noise of `size` and surveyed with 4 mm.
std::vector<ControlPair> pairs(size_t count, double size, unsigned seed) {
  constexpr double kSurvey = 0.004;
  Noise noise(seed);
  std::vector<ControlPair> out;
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p = corners()[i];
    const Eigen::Matrix3d covariance = ellipsoid(size * (1 + 0.5 * double(i % 3)));
    out.push_back({p + noise(covariance),
                   covariance,
                   planted()(p) + noise(kSurvey * kSurvey * Eigen::Matrix3d::Identity()),
                   kSurvey,
                   false});
  }
  return out;
}

TEST(ControlFit, RecoversExactPointsToMicrometresFarFromZero) {
  std::vector<ControlPair> exact;
  for (const Eigen::Vector3d& p : corners()) {
    exact.push_back({p, ellipsoid(1e-3), planted()(p), 0, false});
  }
  const ControlFit fit = fit_control(exact);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(3, 2, 9)}) {
    EXPECT_LT((fit.control_from_scene(p) - planted()(p)).norm(), 1e-7);
  }
  EXPECT_NEAR(fit.control_from_scene.scale, 3.7, 1e-8);
  for (const ControlResidual& residual : fit.residuals) {
    EXPECT_LT(residual.off.norm(), 1e-7);
    EXPECT_TRUE(residual.is_used);
  }
}

// A scene in national coordinates, too.
TEST(ControlFit, KeepsMicrometresWhereBothFramesAreFarFromZero) {
  const Eigen::Vector3d away(-4e5, 5.8e6, 120);
  std::vector<ControlPair> exact;
  for (const Eigen::Vector3d& p : corners()) {
    exact.push_back({p + away, ellipsoid(1e-3), planted()(p), 0, false});
  }
  const ControlFit fit = fit_control(exact);
  const Eigen::Vector3d p(0.5, 0.4, 4);
  EXPECT_LT((fit.control_from_scene(p + away) - planted()(p)).norm(), 1e-6);
}

TEST(ControlFit, ErrsByItsSigmas) {
  double scale = 0;
  double turn = 0;
  double scatter = 0;
  constexpr int kTimes = 150;
  for (unsigned seed = 1; seed <= kTimes; ++seed) {
    const ControlFit fit = fit_control(pairs(8, 0.002, seed));
    const Similarity& s = fit.control_from_scene;
    const double widened = std::max(1.0, fit.scatter);
    scale += std::pow((s.scale - 3.7) / fit.scale_sigma * widened, 2) / kTimes;
    const double angle =
        Eigen::AngleAxisd(s.rotation * planted().rotation.transpose()).angle() / fit.rotation_sigma;
    turn = std::max(turn, angle);
    scatter += fit.scatter * fit.scatter / kTimes;
  }
  EXPECT_NEAR(scale, 1, 0.3);    // of a chi-squared of one, over 150
  EXPECT_NEAR(scatter, 1, 0.1);  // likewise of 17
  EXPECT_LT(turn, 4.5);
}

TEST(ControlFit, NamesTheOutliersAmongFourAndMore) {
  int lost = 0;  // good points
  for (const size_t count : {4u, 5u, 6u, 8u}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const std::vector<ControlPair> good = pairs(count, 0.002, seed);
      std::vector<ControlPair> bad = good;
      const size_t wrong = seed % count;
      bad[wrong].known += Eigen::Vector3d(0.7, -0.9, 0.4);
      const ControlFit fit = fit_control(bad);
      EXPECT_FALSE(fit.residuals[wrong].is_used) << count << " points, seed " << seed;
      for (size_t i = 0; i < count; ++i) lost += i != wrong && !fit.residuals[i].is_used ? 1 : 0;
      EXPECT_GT(fit.residuals[wrong].sigmas, 4);
      EXPECT_LT(std::abs(fit.control_from_scene.scale - 3.7), 5 * fit.scale_sigma);
      EXPECT_NEAR(
          fit.residuals[wrong].off.norm(), std::sqrt(0.7 * 0.7 + 0.9 * 0.9 + 0.4 * 0.4), 0.4);
    }
  }
  EXPECT_LE(lost, 2);  // of 380; the threshold alone gives up one in a thousand
}

// A wrong height tilts any three of them a little, and they still agree.
TEST(ControlFit, KeepsAllOfFourOnLevelGroundAndSaysThatTheyDoNotAgree) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::vector<ControlPair> level;
    Noise noise(seed);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 4),
                                     Eigen::Vector3d(2, 0, 4),
                                     Eigen::Vector3d(2, 2, 4),
                                     Eigen::Vector3d(0, 2.1, 4)}) {
      const Eigen::Matrix3d covariance = ellipsoid(0.001);
      level.push_back({p + noise(covariance), covariance, planted()(p), 0.004, false});
    }
    const Eigen::Vector3d up = planted().rotation * Eigen::Vector3d::UnitZ();
    level[seed % 4].known += 0.3 * up;
    const ControlFit fit = fit_control(level);
    for (const ControlResidual& residual : fit.residuals) EXPECT_TRUE(residual.is_used) << seed;
    EXPECT_GT(fit.scatter, 2) << seed;
  }
}

TEST(ControlFit, NamesTwoOfSix) {
  std::vector<ControlPair> bad = pairs(6, 0.002, 5);
  bad[1].known += Eigen::Vector3d(0.5, 0.5, 0);
  bad[4].known += Eigen::Vector3d(0.5, 0.5, 0);
  const ControlFit fit = fit_control(bad);
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(fit.residuals[i].is_used, i != 1 && i != 4) << i;
}

TEST(ControlFit, KeepsGoodPointsWhoseSigmasAreTooSmall) {
  size_t kept = 0;
  double scatter = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::vector<ControlPair> all = pairs(8, 0.006, seed);
    for (ControlPair& pair : all) {
      pair.covariance /= 9;
      pair.known_sigma /= 3;
    }
    const ControlFit fit = fit_control(all);
    for (const ControlResidual& residual : fit.residuals) kept += residual.is_used ? 1 : 0;
    scatter += fit.scatter / 50;
  }
  EXPECT_GT(kept, 390u);  // of 400
  EXPECT_GT(scatter, 1.8);
  EXPECT_LT(scatter, 3.6);
}

TEST(ControlFit, CheckPointsAreJudgedAndHaveNoSay) {
  std::vector<ControlPair> all = pairs(6, 0.002, 9);
  const ControlFit without = fit_control(all);
  ControlPair check = pairs(8, 0.002, 10).back();
  check.known.z() += 0.5;
  check.is_check = true;
  all.push_back(check);
  const ControlFit with = fit_control(all);
  EXPECT_EQ(with.control_from_scene.scale, without.control_from_scene.scale);
  EXPECT_FALSE(with.residuals.back().is_used);
  EXPECT_NEAR(with.residuals.back().off.z(), -0.5, 0.1);
  EXPECT_GT(with.residuals.back().sigmas, 3);
  EXPECT_FALSE(with.residuals.back().is_met);
  for (size_t i = 0; i < 6; ++i) EXPECT_TRUE(with.residuals[i].is_met);
}

std::string refusal(const std::vector<ControlPair>& all) {
  try {
    fit_control(all);
  } catch (const NumericalError& error) {
    return error.what();
  }
  return "";
}

TEST(ControlFit, SaysWhatIsMissing) {
  std::vector<ControlPair> all = pairs(8, 0.002, 1);
  EXPECT_EQ(test::remedy_of_refusal([&] { fit_control({all[0], all[1]}); }), Remedy::KnownDistance);
  EXPECT_NE(refusal({all[0]}).find("at least 3"), std::string::npos);
  std::vector<ControlPair> checks = all;
  for (size_t i = 2; i < checks.size(); ++i) checks[i].is_check = true;
  EXPECT_NE(refusal(checks).find("2 control points"), std::string::npos);
  std::vector<ControlPair> line = all;
  for (size_t i = 0; i < line.size(); ++i) {
    line[i].measured = {double(i), 0, 4};
    line[i].known = planted()(line[i].measured);
  }
  EXPECT_NE(refusal(line).find("line of the control frame"), std::string::npos) << refusal(line);
  for (ControlPair& pair : line) pair.known = kUtm;
  EXPECT_NE(refusal(line).find("one place of the control frame"), std::string::npos);
  std::vector<ControlPair> seen_in_one_place = all;
  for (ControlPair& pair : seen_in_one_place) pair.measured = {1, 2, 3};
  EXPECT_NE(refusal(seen_in_one_place).find("one place in the photographs"), std::string::npos);
  std::vector<ControlPair> vague = {all[0], all[1], all[2]};
  for (ControlPair& pair : vague) pair.covariance = ellipsoid(0.3);
  EXPECT_NE(refusal(vague).find("rotation"), std::string::npos) << refusal(vague);
}

TEST(ControlFit, TellsThatCoordinatesAreMirrored) {
  std::vector<ControlPair> all = pairs(8, 0.002, 4);
  for (ControlPair& pair : all) std::swap(pair.known.x(), pair.known.y());
  EXPECT_NE(refusal(all).find("mirrored"), std::string::npos) << refusal(all);
}

// The points off the wall are the only ones that show it, and are fewer.
TEST(ControlFit, TellsThatCoordinatesOfAFacadeAreMirrored) {
  for (const size_t off_the_wall : {1u, 2u}) {
    std::vector<Eigen::Vector3d> points = {
        {-1, -1, 4}, {1.2, -0.8, 4}, {1, 1, 4}, {-1.1, 0.9, 4}, {0.1, 0, 4}};
    for (size_t i = 0; i < off_the_wall; ++i) points.emplace_back(0.4 - 0.7 * double(i), 0.2, 3.2);
    for (unsigned seed = 1; seed <= 20; ++seed) {
      Noise noise(seed);
      std::vector<ControlPair> facade;
      for (const Eigen::Vector3d& p : points) {
        const Eigen::Matrix3d covariance = ellipsoid(0.002);
        facade.push_back({p + noise(covariance), covariance, planted()(p), 0.004, false});
      }
      EXPECT_EQ(refusal(facade), "") << seed;
      for (ControlPair& pair : facade) std::swap(pair.known.x(), pair.known.y());
      EXPECT_NE(refusal(facade).find("mirrored"), std::string::npos) << seed << refusal(facade);
    }
  }
}

TEST(ControlFit, SaysThatThreePointsContradictEachOther) {
  std::vector<ControlPair> three = pairs(3, 0.002, 3);
  EXPECT_EQ(refusal(three), "");
  three[2].known += Eigen::Vector3d(3, -2, 2.5);
  EXPECT_NE(refusal(three).find("contradict each other"), std::string::npos) << refusal(three);
}

// Above some 27 points only some of all triples are tried.
TEST(ControlFit, FindsOutliersAmongManyPoints) {
  std::vector<ControlPair> all;
  Noise noise(8);
  for (int i = 0; i < 60; ++i) {
    const Eigen::Matrix3d covariance = ellipsoid(0.002);
    const Eigen::Vector3d p(std::cos(1.7 * i), std::sin(2.9 * i), 4 + std::cos(0.7 * i));
    all.push_back({p + noise(covariance), covariance, planted()(p), 0, false});
    if (i % 4 == 0) all.back().known.y() += 0.8;
  }
  const ControlFit fit = fit_control(all);
  for (size_t i = 0; i < all.size(); ++i) EXPECT_EQ(fit.residuals[i].is_used, i % 4 != 0) << i;
}

}  // namespace
}  // namespace cgs::control_fit_test
