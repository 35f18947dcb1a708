// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/resample.h"

#include <algorithm>
#include <cmath>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "io/camera_checks.h"
#include "libcgs/core/error.h"

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

void undistort(ColorImage& image,
               MaskMap& valid,
               const Camera& camera,
               const std::array<double, 5>& distortion) {
  constexpr int kMaxSide = 32766;  // cv::remap holds positions in 16 bits
  if (image.width > kMaxSide || image.height > kMaxSide) {
    throw LimitError("an image of " + std::to_string(image.width) + " x " +
                     std::to_string(image.height) + " pixels cannot be undistorted, sides up to " +
                     std::to_string(kMaxSide) + " can");
  }
  // OpenCV counts pixel centres from 0, this project from 0.5.
  const cv::Matx33d K(camera.fx, 0, camera.cx - 0.5, 0, camera.fy, camera.cy - 0.5, 0, 0, 1);
  cv::Mat map_x;
  cv::Mat map_y;
  cv::initUndistortRectifyMap(K,
                              cv::Mat(1, 5, CV_64F, const_cast<double*>(distortion.data())),
                              cv::Mat(),
                              K,
                              cv::Size(image.width, image.height),
                              CV_32FC1,
                              map_x,
                              map_y);
  const double fold = fold_radius(distortion);
  if (std::isfinite(fold)) {
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        // Beyond the fold the polynomial runs back into the image and would mirror it.
        const Eigen::Vector3d ray = camera.ray_in_cam(x + 0.5, y + 0.5);
        if (ray.head<2>().norm() >= fold) map_x.at<float>(y, x) = -kMaxSide;
      }
    }
  }
  const cv::Mat coverage = coverage_of(valid, image.width, image.height);
  cv::Mat reached;
  cv::remap(coverage, reached, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  ColorImage out(image.width, image.height, Eigen::Vector3f::Zero());
  cv::Mat target = as_matrix(out);
  cv::remap(as_matrix(image), target, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  for (Eigen::Vector3f& color : out.data) color = color.cwiseMax(0.0f).cwiseMin(1.0f);
  image = std::move(out);
  constexpr float kAll = 0.999f;  // every sample under the pixel, but for rounding
  valid = at_least(reached, kAll);
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
