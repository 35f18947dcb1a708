// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/two_view.h"

#include <algorithm>
#include <cmath>

#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>

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

Eigen::Vector3d ray(const Eigen::Vector2d& at, double focal) {
  return (at / focal).homogeneous().normalized();
}

// Whether the rays meet before both cameras. p_b = R p_a + t with p_a = x a and p_b = y b.
bool is_before_both(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const PhotoPose& pose) {
  const Eigen::Vector3d ra = pose.rotation * a;
  const double c = ra.dot(b);
  const double sine2 = 1 - c * c;
  const double x = (c * pose.translation.dot(b) - pose.translation.dot(ra)) / sine2;
  const double y = (pose.translation.dot(b) - c * pose.translation.dot(ra)) / sine2;
  return x > 0 && y > 0;
}

// Of the four poses of an essential matrix the one with the most points before both cameras.
std::optional<PhotoPose> pose_of(const Eigen::Matrix3d& essential,
                                 const std::vector<Eigen::Vector3d>& a,
                                 const std::vector<Eigen::Vector3d>& b) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d U = svd.matrixU();
  Eigen::Matrix3d V = svd.matrixV();
  if (U.determinant() < 0) U = -U;
  if (V.determinant() < 0) V = -V;
  Eigen::Matrix3d W;
  W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  std::optional<PhotoPose> best;
  size_t most = a.size() / 2;
  for (const Eigen::Matrix3d& R : {Eigen::Matrix3d(U * W * V.transpose()),
                                   Eigen::Matrix3d(U * W.transpose() * V.transpose())}) {
    for (const double sign : {1.0, -1.0}) {
      const PhotoPose pose{Eigen::Quaterniond(R).normalized(), sign * U.col(2)};
      size_t before = 0;
      for (size_t i = 0; i < a.size(); ++i) before += is_before_both(a[i], b[i], pose) ? 1 : 0;
      if (before <= most) continue;
      most = before;
      best = pose;
    }
  }
  return best;
}

// Rotation that takes rays a to rays b, each pair weighted.
Eigen::Matrix3d best_rotation(const std::vector<Eigen::Vector3d>& a,
                              const std::vector<Eigen::Vector3d>& b,
                              const std::vector<double>& weights) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < a.size(); ++i) H += weights[i] * b[i] * a[i].transpose();
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

std::optional<PhotoPose> relative_pose(const MatchedPoints& matches,
                                       double focal_a,
                                       double focal_b,
                                       double threshold) {
  constexpr size_t kFewest = 8;
  if (matches.a.size() < kFewest) return std::nullopt;
  cv::Mat mask;
  const cv::Mat found = cv::findEssentialMat(scaled(matches.a, 1 / focal_a),
                                             scaled(matches.b, 1 / focal_b),
                                             cv::Mat::eye(3, 3, CV_64F),
                                             cv::RANSAC,
                                             kConfidence,
                                             2 * threshold / (focal_a + focal_b),
                                             1000,
                                             mask);
  if (found.rows != 3 || found.cols != 3) return std::nullopt;
  const std::vector<char> is_inlier = mask_of(mask, matches.a.size());
  std::vector<Eigen::Vector3d> a;
  std::vector<Eigen::Vector3d> b;
  for (size_t i = 0; i < matches.a.size(); ++i) {
    if (is_inlier[i] == 0) continue;
    a.push_back(ray(matches.a[i], focal_a));
    b.push_back(ray(matches.b[i], focal_b));
  }
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return pose_of(Eigen::Map<const RowMajor>(found.ptr<double>()), a, b);
}

double parallax(const MatchedPoints& matches, double focal_a, double focal_b) {
  if (matches.a.empty()) return 0;
  std::vector<Eigen::Vector3d> a;
  std::vector<Eigen::Vector3d> b;
  for (size_t i = 0; i < matches.a.size(); ++i) {
    a.push_back(ray(matches.a[i], focal_a));
    b.push_back(ray(matches.b[i], focal_b));
  }
  std::vector<double> weights(a.size(), 1.0);
  std::vector<double> left(a.size());
  constexpr int kRounds = 10;  // of least absolute deviations
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Matrix3d R = best_rotation(a, b, weights);
    for (size_t i = 0; i < a.size(); ++i) {
      left[i] = focal_b * (R * a[i]).cross(b[i]).norm();
      weights[i] = 1 / std::max(left[i], 0.1);
    }
  }
  const auto middle = left.begin() + static_cast<std::ptrdiff_t>(left.size() / 2);
  std::nth_element(left.begin(), middle, left.end());
  return *middle;
}

}  // namespace cgs
