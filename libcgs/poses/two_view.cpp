// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/two_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>

#include "libcgs/core/order_statistics.h"
#include "libcgs/core/split_mix.h"

namespace cgs {

namespace {

constexpr double kConfidence = 0.9999;
constexpr int kMostTrials = 20000;

std::vector<cv::Point2d> scaled(const std::vector<Eigen::Vector2d>& points, double scale) {
  std::vector<cv::Point2d> out;
  out.reserve(points.size());
  for (const Eigen::Vector2d& p : points) out.emplace_back(p.x() * scale, p.y() * scale);
  return out;
}

std::vector<char> mask_of(const cv::Mat& mask, size_t count) {
  std::vector<char> out(count, 0);
  for (size_t i = 0; i < count && i < mask.total(); ++i) {
    out[i] = mask.at<uchar>(static_cast<int>(i)) != 0 ? 1 : 0;
  }
  return out;
}

/// Directions with z = 1 of matched points.
struct Rays {
  std::vector<Eigen::Vector3d> a;
  std::vector<Eigen::Vector3d> b;
};

Rays rays_of(const MatchedPoints& matches, double focal_a, double focal_b) {
  Rays rays;
  for (size_t i = 0; i < matches.a.size(); ++i) {
    rays.a.push_back((matches.a[i] / focal_a).homogeneous());
    rays.b.push_back((matches.b[i] / focal_b).homogeneous());
  }
  return rays;
}

constexpr size_t kSample = 5;

// The essential matrices, up to ten, that explain five matches drawn at random.
std::vector<Eigen::Matrix3d> essentials_of_sample(const Rays& rays, uint64_t trial) {
  std::array<size_t, kSample> drawn = {};
  uint64_t index = trial << 16;
  for (size_t k = 0; k < kSample; ++k) {
    do {
      drawn[k] = static_cast<size_t>(random_number(index++) % rays.a.size());
    } while (std::find(drawn.begin(), drawn.begin() + k, drawn[k]) != drawn.begin() + k);
  }
  std::vector<cv::Point2d> a;
  std::vector<cv::Point2d> b;
  for (const size_t i : drawn) {
    a.emplace_back(rays.a[i].x(), rays.a[i].y());
    b.emplace_back(rays.b[i].x(), rays.b[i].y());
  }
  const cv::Mat found = cv::findEssentialMat(a, b, cv::Mat::eye(3, 3, CV_64F));
  std::vector<Eigen::Matrix3d> out;
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  for (int row = 0; row + 3 <= found.rows; row += 3) {
    const Eigen::Matrix3d essential = Eigen::Map<const RowMajor>(found.ptr<double>(row));
    if (essential.allFinite()) out.push_back(essential);
  }
  return out;
}

// Squared distance of a match from its epipolar lines, to first order (Sampson).
double epipolar_error2(const Eigen::Matrix3d& essential,
                       const Eigen::Vector3d& a,
                       const Eigen::Vector3d& b) {
  const Eigen::Vector3d line_b = essential * a;
  const Eigen::Vector3d line_a = essential.transpose() * b;
  const double off = b.dot(line_b);
  return off * off / (line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm());
}

double epipolar_cost(const Eigen::Matrix3d& essential, const Rays& rays, double limit) {
  constexpr size_t kEnough = 500;  // matches to tell a good matrix from a bad one
  const size_t step = std::max(size_t{1}, rays.a.size() / kEnough);
  double sum = 0;
  for (size_t i = 0; i < rays.a.size(); i += step) {
    sum += std::min(epipolar_error2(essential, rays.a[i], rays.b[i]), limit * limit);
  }
  return sum;
}

// Whether the rays meet before both cameras. p_b = R p_a + t with p_a = x a and p_b = y b.
bool is_before_both(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const PhotoPose& pose) {
  const Eigen::Vector3d ra = pose.rotation * a.normalized();
  const Eigen::Vector3d rb = b.normalized();
  const double c = ra.dot(rb);
  const double sine2 = 1 - c * c;
  const double x = (c * pose.translation.dot(rb) - pose.translation.dot(ra)) / sine2;
  const double y = (pose.translation.dot(rb) - c * pose.translation.dot(ra)) / sine2;
  return x > 0 && y > 0;
}

// Of the four poses of an essential matrix the one with the most points before both cameras.
std::optional<PhotoPose> pose_of(const Eigen::Matrix3d& essential, const Rays& rays) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d U = svd.matrixU();
  Eigen::Matrix3d V = svd.matrixV();
  if (U.determinant() < 0) U = -U;
  if (V.determinant() < 0) V = -V;
  Eigen::Matrix3d W;
  W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  std::optional<PhotoPose> best;
  size_t most = rays.a.size() / 2;
  for (const Eigen::Matrix3d& R : {Eigen::Matrix3d(U * W * V.transpose()),
                                   Eigen::Matrix3d(U * W.transpose() * V.transpose())}) {
    for (const double sign : {1.0, -1.0}) {
      const PhotoPose pose{Eigen::Quaterniond(R).normalized(), sign * U.col(2)};
      size_t before = 0;
      for (size_t i = 0; i < rays.a.size(); ++i) {
        before += is_before_both(rays.a[i], rays.b[i], pose) ? 1 : 0;
      }
      if (before <= most) continue;
      most = before;
      best = pose;
    }
  }
  return best;
}

bool is_before_both_of_most(const Rays& rays,
                            const std::vector<char>& used,
                            const PhotoPose& pose) {
  size_t before = 0;
  size_t all = 0;
  for (size_t i = 0; i < rays.a.size(); ++i) {
    if (used[i] == 0) continue;
    ++all;
    before += is_before_both(rays.a[i], rays.b[i], pose) ? 1 : 0;
  }
  return 2 * before > all;
}

// Where most matches lie on a plane, the poses that its homography can mean: up to two, as seen
// from before it. `limit` is a distance at z = 1.
std::vector<PhotoPose> poses_of_plane(const Rays& rays, double limit) {
  constexpr double kPlanar = 0.6;
  constexpr int kTrials = 200;  // an eighth of them hits the plane where there is one
  std::vector<cv::Point2d> a;
  std::vector<cv::Point2d> b;
  for (size_t i = 0; i < rays.a.size(); ++i) {
    a.emplace_back(rays.a[i].x(), rays.a[i].y());
    b.emplace_back(rays.b[i].x(), rays.b[i].y());
  }
  cv::Mat mask;
  const cv::Mat plane = cv::findHomography(a, b, cv::RANSAC, 2 * limit, mask, kTrials, kConfidence);
  const std::vector<char> used = mask_of(mask, a.size());
  const auto on_plane = std::count(used.begin(), used.end(), char{1});
  if (plane.empty() || double(on_plane) < kPlanar * double(a.size())) return {};
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  std::vector<cv::Mat> normals;
  cv::decomposeHomographyMat(plane, cv::Mat::eye(3, 3, CV_64F), rotations, translations, normals);
  std::vector<PhotoPose> out;
  for (size_t k = 0; k < rotations.size(); ++k) {
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Matrix3d R = Eigen::Map<const RowMajor>(rotations[k].ptr<double>());
    const Eigen::Vector3d t = Eigen::Map<const Eigen::Vector3d>(translations[k].ptr<double>());
    if (!R.allFinite() || !(t.norm() > 0)) continue;
    const PhotoPose pose{Eigen::Quaterniond(R).normalized(), t.normalized()};
    if (is_before_both_of_most(rays, used, pose)) out.push_back(pose);
  }
  return out;
}

// Rotation that takes rays a to rays b, each pair weighted.
Eigen::Matrix3d best_rotation(const Rays& rays, const std::vector<double>& weights) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < weights.size(); ++i) {
    H += weights[i] * rays.b[i] * rays.a[i].transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::vector<char> epipolar_inliers(const MatchedPoints& matches, double threshold) {
  constexpr size_t kFewest = 8;
  if (matches.a.size() < kFewest) return std::vector<char>(matches.a.size(), 0);
  cv::Mat mask;
  (void)cv::findFundamentalMat(scaled(matches.a, 1),
                               scaled(matches.b, 1),
                               cv::FM_RANSAC,
                               threshold,
                               kConfidence,
                               kMostTrials,
                               mask);
  return mask_of(mask, matches.a.size());
}

std::vector<char> homography_inliers(const MatchedPoints& matches, double threshold) {
  constexpr size_t kFewest = 4;
  if (matches.a.size() < kFewest) return std::vector<char>(matches.a.size(), 0);
  cv::Mat mask;
  (void)cv::findHomography(scaled(matches.a, 1),
                           scaled(matches.b, 1),
                           cv::RANSAC,
                           threshold,
                           mask,
                           kMostTrials,
                           kConfidence);
  return mask_of(mask, matches.a.size());
}

std::vector<PhotoPose> relative_poses(const MatchedPoints& matches,
                                      double focal_a,
                                      double focal_b,
                                      double threshold) {
  if (matches.a.size() < kSample + 3) return {};
  const Rays rays = rays_of(matches, focal_a, focal_b);
  const double limit = 2 * threshold / (focal_a + focal_b);
  std::optional<Eigen::Matrix3d> best;
  double least = std::numeric_limits<double>::infinity();
  // Few matches are wrong, so few samples hit one; but where the cameras stand close together,
  // many samples fit nearly as well as the right one.
  constexpr uint64_t kTrials = 400;
  for (uint64_t trial = 0; trial < kTrials; ++trial) {
    for (const Eigen::Matrix3d& essential : essentials_of_sample(rays, trial)) {
      const double cost = epipolar_cost(essential, rays, limit);
      if (cost >= least) continue;
      least = cost;
      best = essential;
    }
  }
  if (!best) return {};
  Rays agreeing;
  for (size_t i = 0; i < rays.a.size(); ++i) {
    if (epipolar_error2(*best, rays.a[i], rays.b[i]) > limit * limit) continue;
    agreeing.a.push_back(rays.a[i]);
    agreeing.b.push_back(rays.b[i]);
  }
  const std::optional<PhotoPose> pose = pose_of(*best, agreeing);
  std::vector<PhotoPose> out = poses_of_plane(rays, limit);
  if (pose) out.insert(out.begin(), *pose);
  return out;
}

double parallax(const MatchedPoints& matches, double focal_a, double focal_b) {
  if (matches.a.empty()) return 0;
  Rays rays = rays_of(matches, focal_a, focal_b);
  for (Eigen::Vector3d& ray : rays.a) ray.normalize();
  for (Eigen::Vector3d& ray : rays.b) ray.normalize();
  std::vector<double> weights(rays.a.size(), 1.0);
  std::vector<double> left(rays.a.size());
  constexpr int kRounds = 10;  // of least absolute deviations
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Matrix3d R = best_rotation(rays, weights);
    for (size_t i = 0; i < rays.a.size(); ++i) {
      left[i] = focal_b * (R * rays.a[i]).cross(rays.b[i]).norm();
      weights[i] = 1 / std::max(left[i], 0.1);
    }
  }
  return median(left);
}

}  // namespace cgs
