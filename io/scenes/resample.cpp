// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <tbb/parallel_for.h>

#include "io/scenes/camera_checks.h"

namespace cgs {

namespace {

static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));

cv::Mat as_matrix(ColorImage& image) {
  return {image.height, image.width, CV_32FC3, image.data.data()};
}

cv::Mat coverage_of(const MaskMap& valid, int width, int height) {
  cv::Mat coverage(height, width, CV_32FC1, cv::Scalar(1));
  if (valid.empty()) return coverage;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      coverage.at<float>(y, x) = valid(x, y) != 0 ? 1.0f : 0.0f;
    }
  }
  return coverage;
}

MaskMap at_least(const cv::Mat& coverage, float threshold) {
  MaskMap valid(coverage.cols, coverage.rows, 0);
  bool is_all = true;
  for (int y = 0; y < valid.height; ++y) {
    for (int x = 0; x < valid.width; ++x) {
      valid(x, y) = coverage.at<float>(y, x) >= threshold ? 1 : 0;
      is_all = is_all && valid(x, y) != 0;
    }
  }
  return is_all ? MaskMap() : valid;
}

}  // namespace

namespace {

// Weights of the samples before - 1 … before + 2 around a position, by Catmull-Rom interpolation
// (Keys 1981, a = -1/2), which reproduces quadratics; OpenCV's bicubic (a = -3/4, positions
// rounded to 1/32 pixel) bends even a linear ramp. Linear where the outer samples do not exist.
std::array<double, 4> cubic_weights(int before, double t, int size) {
  if (before < 1 || before + 2 >= size) return {0, 1 - t, t, 0};
  return {0.5 * t * (-1 + t * (2 - t)),
          1 + 0.5 * t * t * (-5 + 3 * t),
          0.5 * t * (1 + t * (4 - 3 * t)),
          0.5 * t * t * (t - 1)};
}

// u and v count from the centre of the first pixel and lie inside the image.
Eigen::Vector3f sample(const ColorImage& image, double u, double v) {
  const int x0 = static_cast<int>(std::floor(u));
  const int y0 = static_cast<int>(std::floor(v));
  const std::array<double, 4> wx = cubic_weights(x0, u - x0, image.width);
  const std::array<double, 4> wy = cubic_weights(y0, v - y0, image.height);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int j = 0; j < 4; ++j) {
    const int y = std::clamp(y0 + j - 1, 0, image.height - 1);
    Eigen::Vector3d row = Eigen::Vector3d::Zero();
    for (int i = 0; i < 4; ++i) {
      const int x = std::clamp(x0 + i - 1, 0, image.width - 1);
      row += wx[static_cast<size_t>(i)] * image(x, y).cast<double>();
    }
    sum += wy[static_cast<size_t>(j)] * row;
  }
  return sum.cast<float>().cwiseMax(0.0f).cwiseMin(1.0f);
}

// True if all pixels that a bilinear interpolation at (u, v) would touch may be used.
bool is_covered(const MaskMap& valid, double u, double v) {
  if (valid.empty()) return true;
  const int x0 = static_cast<int>(std::floor(u));
  const int y0 = static_cast<int>(std::floor(v));
  const int x1 = std::min(x0 + 1, valid.width - 1);
  const int y1 = std::min(y0 + 1, valid.height - 1);
  return valid(x0, y0) != 0 && valid(x1, y0) != 0 && valid(x0, y1) != 0 && valid(x1, y1) != 0;
}

// An image of another size whose pixels come from where `from`(x, y) says, counted from the centre
// of the first pixel; 0, and not valid, where that is outside or NaN.
template <typename From>
void resample(ColorImage& image, MaskMap& valid, const cv::Size& size, const From& from) {
  ColorImage out(size.width, size.height, Eigen::Vector3f::Zero());
  MaskMap reached(size.width, size.height, 0);
  tbb::parallel_for(0, size.height, [&](int y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector2d at = from(x, y);
      const double u = at.x();
      const double v = at.y();
      const bool is_inside = u >= 0 && v >= 0 && u <= image.width - 1 && v <= image.height - 1;
      if (!is_inside || !is_covered(valid, u, v)) continue;
      out(x, y) = sample(image, u, v);
      reached(x, y) = 1;
    }
  });
  image = std::move(out);
  const bool is_all =
      std::all_of(reached.data.begin(), reached.data.end(), [](uint8_t set) { return set != 0; });
  valid = is_all ? MaskMap() : std::move(reached);
}

// OpenCV counts pixel centres from 0, this project from 0.5.
cv::Matx33d opencv_intrinsics(const Camera& camera) {
  return {camera.fx, 0, camera.cx - 0.5, 0, camera.fy, camera.cy - 0.5, 0, 0, 1};
}

}  // namespace

void undistort(ColorImage& image,
               MaskMap& valid,
               const Camera& camera,
               const std::array<double, 5>& distortion) {
  const cv::Matx33d K = opencv_intrinsics(camera);
  const cv::Vec<double, 5> coefficients(distortion.data());
  const cv::Size size(image.width, image.height);
  cv::Mat map_u;
  cv::Mat map_v;
  cv::initUndistortRectifyMap(K, coefficients, cv::noArray(), K, size, CV_32FC1, map_u, map_v);
  const double fold = fold_radius(distortion);
  resample(image, valid, size, [&](int x, int y) -> Eigen::Vector2d {
    // Beyond the fold the polynomial runs back into the image and would mirror it.
    const double radius = camera.ray_in_cam(x + 0.5, y + 0.5).head<2>().norm();
    if (!(radius < fold)) return Eigen::Vector2d::Constant(-1);
    return {map_u.at<float>(y, x), map_v.at<float>(y, x)};
  });
}

void undistort(ColorImage& image, MaskMap& valid, const FisheyeMap& fisheye) {
  const cv::Size size(fisheye.picture().width, fisheye.picture().height);
  resample(image, valid, size, [&](int x, int y) -> Eigen::Vector2d {
    const Eigen::Vector2d at = fisheye.in_photograph({x + 0.5, y + 0.5});
    if (!fisheye.shows(at)) return Eigen::Vector2d::Constant(-1);
    return at - Eigen::Vector2d::Constant(0.5);
  });
}

Eigen::Vector2d undistorted(const Eigen::Vector2d& point,
                            const Camera& camera,
                            const std::array<double, 5>& distortion) {
  const cv::Matx33d K = opencv_intrinsics(camera);
  const std::vector<cv::Point2d> from = {{point.x() - 0.5, point.y() - 0.5}};
  std::vector<cv::Point2d> to;
  // By default it takes five steps, which leaves half a pixel where lenses bend strongly.
  const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-10);
  cv::undistortPoints(from, to, K, cv::Vec<double, 5>(distortion.data()), cv::noArray(), K, until);
  return {to[0].x + 0.5, to[0].y + 0.5};
}

Eigen::Vector2d distorted(const Eigen::Vector2d& point,
                          const Camera& camera,
                          const std::array<double, 5>& distortion) {
  const Eigen::Vector3d ray = camera.ray_in_cam(point.x(), point.y());
  if (!(ray.head<2>().norm() < fold_radius(distortion))) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  const std::vector<cv::Point3d> from = {{ray.x(), ray.y(), ray.z()}};
  std::vector<cv::Point2d> to;
  cv::projectPoints(from,
                    cv::Vec3d(),
                    cv::Vec3d(),
                    opencv_intrinsics(camera),
                    cv::Vec<double, 5>(distortion.data()),
                    to);
  return {to[0].x + 0.5, to[0].y + 0.5};
}

bool is_undone(const Eigen::Vector2d& point,
               const Eigen::Vector2d& undistorted,
               const Camera& camera,
               const std::array<double, 5>& distortion) {
  constexpr double kUndone = 0.01;  // [pixels]
  return (distorted(undistorted, camera, distortion) - point).norm() <= kUndone;
}

void area_downscale(ColorImage& image, MaskMap& valid, int width, int height) {
  if (image.width == width && image.height == height) return;
  ColorImage out(width, height, Eigen::Vector3f::Zero());
  cv::Mat target = as_matrix(out);
  const cv::Size size(width, height);
  if (valid.empty()) {
    cv::resize(as_matrix(image), target, size, 0, 0, cv::INTER_AREA);
    image = std::move(out);
    return;
  }
  const cv::Mat coverage = coverage_of(valid, image.width, image.height);
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (valid.data[i] == 0) image.data[i].setZero();
  }
  cv::Mat weight;
  cv::resize(coverage, weight, size, 0, 0, cv::INTER_AREA);
  cv::resize(as_matrix(image), target, size, 0, 0, cv::INTER_AREA);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float w = weight.at<float>(y, x);
      if (w > 0) out(x, y) = (out(x, y) / w).cwiseMin(1.0f);
    }
  }
  image = std::move(out);
  constexpr float kHalf = 0.5f;
  valid = at_least(weight, kHalf);
}

}  // namespace cgs
