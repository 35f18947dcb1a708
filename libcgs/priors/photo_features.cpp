// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/photo_features.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

cv::Mat grey_picture(const ColorImage& image, int largest_side) {
  const cv::Mat rgb(image.height,
                    image.width,
                    CV_32FC3,
                    const_cast<float*>(image.data.front().data()));  // NOLINT: only read
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  cv::Mat bytes;
  grey.convertTo(bytes, CV_8U, 255);
  const double scale = double(largest_side) / std::max(image.width, image.height);
  if (scale >= 1) return bytes;
  cv::Mat small;
  const cv::Size size(std::max(1, int(std::lround(scale * image.width))),
                      std::max(1, int(std::lround(scale * image.height))));
  cv::resize(bytes, small, size, 0, 0, cv::INTER_AREA);
  return small;
}

// Pixels of the picture searched that may be used; no matrix where all may.
cv::Mat mask_of(const MaskMap& usable, const cv::Size& size) {
  if (usable.empty()) return {};
  const cv::Mat whole(
      usable.height, usable.width, CV_8UC1, const_cast<uint8_t*>(usable.data.data()));
  cv::Mat small;
  cv::resize(whole, small, size, 0, 0, cv::INTER_NEAREST);
  return small;
}

// Strongest first. Every field takes part: the order, and with it what is kept, must not depend on
// the order in which threads found them.
void sort_and_cut(std::vector<cv::KeyPoint>& points, int most) {
  const auto key = [](const cv::KeyPoint& p) {
    return std::tuple(-p.response, p.pt.y, p.pt.x, p.size, p.angle, p.octave);
  };
  std::sort(points.begin(), points.end(), [&](const cv::KeyPoint& a, const cv::KeyPoint& b) {
    return key(a) < key(b);
  });
  if (points.size() > static_cast<size_t>(most)) points.resize(static_cast<size_t>(most));
}

using Descriptors = decltype(PhotoFeatures::descriptors);

// Nearest and second nearest by the largest dot products of unit vectors.
struct Nearest {
  float best = -1;
  float second = -1;
  int index = -1;

  void add(float dot, int i) {
    if (dot > best) {
      second = best;
      best = dot;
      index = i;
    } else {
      second = std::max(second, dot);
    }
  }
  bool is_distinct() const {
    constexpr double kRatio = 0.8;
    const double near = std::max(0.0, 2 - 2 * double(best));  // squared distances
    const double next = std::max(0.0, 2 - 2 * double(second));
    return index >= 0 && near < kRatio * kRatio * next;
  }
};

}  // namespace

void FeatureOptions::validate() const {
  require(largest_side >= 64, "FeatureOptions.largest_side must be >= 64", largest_side);
  require(most >= 1, "FeatureOptions.most must be >= 1", most);
}

Raster<uint8_t> searched_picture(const ColorImage& image, const FeatureOptions& options) {
  const cv::Mat picture = grey_picture(image, options.largest_side);
  Raster<uint8_t> out(picture.cols, picture.rows, 0);
  for (int y = 0; y < out.height; ++y) {
    std::copy_n(picture.ptr<uint8_t>(y), out.width, &out(0, y));
  }
  return out;
}

PhotoFeatures detect_features(const ColorImage& image,
                              const MaskMap& usable,
                              const FeatureOptions& options) {
  options.validate();
  const cv::Mat picture = grey_picture(image, options.largest_side);
  // Half of the usual contrast: photographs of stone and plaster have few strong corners, and
  // matching throws out what is not distinct.
  constexpr int kOctaveLayers = 3;
  constexpr double kContrast = 0.02;
  const auto sift = cv::SIFT::create(0, kOctaveLayers, kContrast);
  std::vector<cv::KeyPoint> found;
  sift->detect(picture, found, mask_of(usable, picture.size()));
  sort_and_cut(found, options.most);
  cv::Mat descriptors;
  sift->compute(picture, found, descriptors);

  PhotoFeatures out;
  const double to_image_x = double(image.width) / picture.cols;
  const double to_image_y = double(image.height) / picture.rows;
  out.pixel = std::max(to_image_x, to_image_y);
  out.points.reserve(found.size());
  for (const cv::KeyPoint& p : found) {
    // OpenCV counts from the centre of the first pixel, and its doubling of the picture before
    // the search moves everything by a quarter of a pixel.
    constexpr double kDoubling = -0.25;
    out.points.emplace_back((double(p.pt.x) + 0.5 + kDoubling) * to_image_x,
                            (double(p.pt.y) + 0.5 + kDoubling) * to_image_y);
  }
  out.descriptors.resize(descriptors.rows, descriptors.cols);
  for (int i = 0; i < descriptors.rows; ++i) {
    const Eigen::Map<const Eigen::RowVectorXf> row(descriptors.ptr<float>(i), descriptors.cols);
    const float sum = row.sum();
    out.descriptors.row(i) = sum > 0 ? Eigen::RowVectorXf((row / sum).cwiseSqrt()) : row;
  }
  return out;
}

std::vector<FeatureMatch> match_features(const PhotoFeatures& a,
                                         const PhotoFeatures& b,
                                         const Progress& progress) {
  std::vector<Nearest> of_a(a.points.size());
  std::vector<Nearest> of_b(b.points.size());
  constexpr Eigen::Index kBlock = 512;  // products of two blocks stay in the cache
  Descriptors dots;
  for (Eigen::Index i = 0; i < a.descriptors.rows(); i += kBlock) {
    report(progress, double(i) / double(a.descriptors.rows()));
    const Eigen::Index rows = std::min(kBlock, a.descriptors.rows() - i);
    for (Eigen::Index j = 0; j < b.descriptors.rows(); j += kBlock) {
      const Eigen::Index cols = std::min(kBlock, b.descriptors.rows() - j);
      dots.noalias() =
          a.descriptors.middleRows(i, rows) * b.descriptors.middleRows(j, cols).transpose();
      for (Eigen::Index r = 0; r < rows; ++r) {
        for (Eigen::Index c = 0; c < cols; ++c) {
          of_a[static_cast<size_t>(i + r)].add(dots(r, c), static_cast<int>(j + c));
          of_b[static_cast<size_t>(j + c)].add(dots(r, c), static_cast<int>(i + r));
        }
      }
    }
  }
  std::vector<FeatureMatch> out;
  for (size_t i = 0; i < of_a.size(); ++i) {
    if (!of_a[i].is_distinct()) continue;
    const Nearest& back = of_b[static_cast<size_t>(of_a[i].index)];
    if (back.index == static_cast<int>(i) && back.is_distinct()) {
      out.push_back({static_cast<int>(i), of_a[i].index});
    }
  }
  return out;
}

}  // namespace cgs
