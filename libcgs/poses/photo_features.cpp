// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/photo_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "libcgs/core/error.h"
#include "libcgs/core/lanes.h"

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

/// What was found, and what each looks like.
struct Found {
  cv::KeyPoint point;
  cv::Mat descriptor;
};

// Every field takes part: the order, and with it what is kept, must not depend on the order in
// which threads found them.
auto strength_key(const cv::KeyPoint& p) {
  return std::tuple(-p.response, p.pt.y, p.pt.x, p.size, p.angle, p.octave);
}

auto strength_key(const Found& found) { return strength_key(found.point); }

// Strongest first.
template <typename T>
void sort_and_cut(std::vector<T>& found, size_t most) {
  std::stable_sort(found.begin(), found.end(), [](const T& a, const T& b) {
    return strength_key(a) < strength_key(b);
  });
  if (found.size() > most) found.resize(most);
}

Raster<uint8_t> raster_of(const cv::Mat& picture) {
  Raster<uint8_t> out(picture.cols, picture.rows, 0);
  for (int y = 0; y < out.height; ++y) {
    std::copy_n(picture.ptr<uint8_t>(y), out.width, &out(0, y));
  }
  return out;
}

cv::Ptr<cv::SIFT> sift() {
  // Half of the usual contrast: photographs of stone and plaster have few strong corners, and
  // matching throws out what is not distinct.
  constexpr int kOctaveLayers = 3;
  constexpr double kContrast = 0.02;
  return cv::SIFT::create(0, kOctaveLayers, kContrast);
}

// From places in the picture searched to those in the photograph.
struct ToPhotograph {
  double x, y;

  ToPhotograph(const ColorImage& image, const cv::Mat& picture)
      : x(double(image.width) / picture.cols), y(double(image.height) / picture.rows) {}
  double pixel() const { return std::max(x, y); }
  Eigen::Vector2d operator()(const cv::Point2f& at) const {
    // OpenCV counts from the centre of the first pixel, and its doubling of the picture before
    // the search moves everything by a quarter of a pixel.
    constexpr double kDoubling = -0.25;
    return {(double(at.x) + 0.5 + kDoubling) * x, (double(at.y) + 0.5 + kDoubling) * y};
  }
};

Eigen::RowVectorXf rooted(const cv::Mat& descriptor) {
  const Eigen::Map<const Eigen::RowVectorXf> row(descriptor.ptr<float>(), descriptor.cols);
  const float sum = row.sum();
  return sum > 0 ? Eigen::RowVectorXf((row / sum).cwiseSqrt()) : row;
}

// Points by place: those found within a distance of an earlier one are the same.
class Places {
 public:
  explicit Places(const cv::Size& size)
      : columns_(static_cast<int>(size.width / kSame) + 3),
        rows_(static_cast<int>(size.height / kSame) + 3),
        cells_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)) {}

  // \return number of the place, counted in the order in which they were new
  int add(const cv::Point2f& at) {
    // A little beside the picture counts as at its border.
    const int x = std::clamp(static_cast<int>(double(at.x) / kSame), 0, columns_ - 3) + 1;
    const int y = std::clamp(static_cast<int>(double(at.y) / kSame), 0, rows_ - 3) + 1;
    for (int j = y - 1; j <= y + 1; ++j) {
      for (int i = x - 1; i <= x + 1; ++i) {
        for (const int place : cell(i, j)) {
          if (cv::norm(points_[static_cast<size_t>(place)] - at) < kSame) return place;
        }
      }
    }
    cell(x, y).push_back(static_cast<int>(points_.size()));
    points_.push_back(at);
    return static_cast<int>(points_.size()) - 1;
  }
  const std::vector<cv::Point2f>& points() const { return points_; }

 private:
  static constexpr double kSame = 1.5;  // [pixels]
  std::vector<int>& cell(int x, int y) {
    return cells_[static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x)];
  }

  int columns_;
  int rows_;
  std::vector<std::vector<int>> cells_;
  std::vector<cv::Point2f> points_;
};

// How much farther than without tilt OpenCV finds things from where they are, in a picture that it
// compresses along a direction [degrees]: doubling moves by a quarter of a compressed pixel, and
// taking every so many pixels of a row, the nearest before, by half a pixel on average.
cv::Point2f shift_of_tilt(float tilt, float direction) {
  constexpr double kDoubling = 0.25;
  if (tilt == 1) return {0, 0};
  const double along = kDoubling * double(tilt) + 0.5;
  const Eigen::Rotation2Dd turn(-double(direction) * std::numbers::pi / 180);
  const Eigen::Vector2d shift = turn * Eigen::Vector2d(along, kDoubling);
  return {static_cast<float>(shift.x() - kDoubling), static_cast<float>(shift.y() - kDoubling)};
}

using Descriptors = decltype(PhotoFeatures::descriptors);

// Nearest row, and nearest row of another point, by the largest dot products of unit vectors.
struct Nearest {
  float best = -1;
  float second = -1;
  int row = -1;
  int point = -1;

  void add(float dot, int i, int of) {
    if (dot > best) {
      if (of != point) second = best;
      best = dot;
      row = i;
      point = of;
    } else if (of != point) {
      second = std::max(second, dot);
    }
  }
  bool is_distinct() const {
    constexpr double kRatio = 0.8;
    const double near = std::max(0.0, 2 - 2 * double(best));  // squared distances
    const double next = std::max(0.0, 2 - 2 * double(second));
    return row >= 0 && near < kRatio * kRatio * next;
  }
};

int point_of_row(const PhotoFeatures& features, Eigen::Index row) {
  return features.point_of.empty() ? static_cast<int>(row)
                                   : features.point_of[static_cast<size_t>(row)];
}

/// Of all rows of a in b, and of b in a.
using NearestOfBoth = std::pair<std::vector<Nearest>, std::vector<Nearest>>;

// Calls visit(dots, i, j) with the products of rows of a from i on with rows of b from j on.
template <typename Visit>
void for_each_block(const PhotoFeatures& a,
                    const PhotoFeatures& b,
                    const Progress& progress,
                    const Visit& visit) {
  constexpr Eigen::Index kBlock = 512;  // products of two blocks stay in the cache
  Descriptors dots;
  for (Eigen::Index i = 0; i < a.descriptors.rows(); i += kBlock) {
    report(progress, double(i) / double(a.descriptors.rows()));
    const Eigen::Index rows = std::min(kBlock, a.descriptors.rows() - i);
    for (Eigen::Index j = 0; j < b.descriptors.rows(); j += kBlock) {
      const Eigen::Index cols = std::min(kBlock, b.descriptors.rows() - j);
      dots.noalias() =
          a.descriptors.middleRows(i, rows) * b.descriptors.middleRows(j, cols).transpose();
      visit(dots, i, j);
    }
  }
}

// Where points have several rows.
NearestOfBoth nearest_of_looks(const PhotoFeatures& a,
                               const PhotoFeatures& b,
                               const Progress& progress) {
  std::vector<Nearest> of_a(static_cast<size_t>(a.descriptors.rows()));
  std::vector<Nearest> of_b(static_cast<size_t>(b.descriptors.rows()));
  for_each_block(a, b, progress, [&](const Descriptors& dots, Eigen::Index i, Eigen::Index j) {
    for (Eigen::Index r = 0; r < dots.rows(); ++r) {
      const int in_a = point_of_row(a, i + r);
      for (Eigen::Index c = 0; c < dots.cols(); ++c) {
        of_a[static_cast<size_t>(i + r)].add(
            dots(r, c), static_cast<int>(j + c), point_of_row(b, j + c));
        of_b[static_cast<size_t>(j + c)].add(dots(r, c), static_cast<int>(i + r), in_a);
      }
    }
  });
  return {std::move(of_a), std::move(of_b)};
}

// Nearest rows so far, in eight lanes.
struct NearestLanes {
  Floats best = Floats{} - 1;
  Floats second = Floats{} - 1;
  Ints row = Ints{} - 1;

  // The first of equal ones stays.
  void add(const Floats& dots, const Ints& of) {
    const Ints is_nearer = dots > best;
    second = max(second, min(best, dots));
    row = (is_nearer & of) | (~is_nearer & row);
    best = max(best, dots);
  }
};

// Nearest rows of many others, each of another point: in arrays, to be compared in lanes.
struct NearestRows {
  std::vector<float> best, second;
  std::vector<int32_t> row;

  explicit NearestRows(Eigen::Index rows)
      : best(static_cast<size_t>(rows), -1), second(best), row(best.size(), -1) {}
  void add(size_t at, float dot, int32_t of) {
    second[at] = std::max(second[at], std::min(best[at], dot));
    if (dot > best[at]) row[at] = of;
    best[at] = std::max(best[at], dot);
  }
  // Of eight from `at` on.
  void add(size_t at, const Floats& dots, int32_t of) {
    NearestLanes lanes{load<Floats>(&best[at]), load<Floats>(&second[at]), load<Ints>(&row[at])};
    lanes.add(dots, Ints{} + of);
    store(lanes.best, &best[at]);
    store(lanes.second, &second[at]);
    store(lanes.row, &row[at]);
  }
  // What lanes have found for one, as if they had been one: the first of equal rows stays.
  void add(size_t at, NearestLanes lanes) {
    for (int k = 0; k < kLanes; ++k) {
      int first = -1;
      for (int lane = 0; lane < kLanes; ++lane) {
        if (lanes.row[lane] < 0) continue;
        if (first < 0 || lanes.row[lane] < lanes.row[first]) first = lane;
      }
      if (first < 0) return;
      add(at, lanes.best[first], lanes.row[first]);
      add(at, lanes.second[first], lanes.row[first]);
      lanes.row[first] = -1;
    }
  }
  std::vector<Nearest> list() const {
    std::vector<Nearest> out;
    out.reserve(best.size());
    for (size_t i = 0; i < best.size(); ++i) out.push_back({best[i], second[i], row[i], row[i]});
    return out;
  }
};

// Where each point has one row.
NearestOfBoth nearest_of_points(const PhotoFeatures& a,
                                const PhotoFeatures& b,
                                const Progress& progress) {
  NearestRows of_a(a.descriptors.rows());
  NearestRows of_b(b.descriptors.rows());
  for_each_block(a, b, progress, [&](const Descriptors& dots, Eigen::Index i, Eigen::Index j) {
    const auto in_b = static_cast<int32_t>(j);
    for (Eigen::Index r = 0; r < dots.rows(); ++r) {
      const float* const row = &dots(r, 0);
      const auto in_a = static_cast<int32_t>(i + r);
      const auto at = static_cast<size_t>(in_a);
      NearestLanes lanes;
      int32_t c = 0;
      for (; c + kLanes <= static_cast<int32_t>(dots.cols()); c += kLanes) {
        const auto eight = load<Floats>(row + c);
        lanes.add(eight, Ints{0, 1, 2, 3, 4, 5, 6, 7} + (in_b + c));
        of_b.add(static_cast<size_t>(in_b + c), eight, in_a);
      }
      of_a.add(at, lanes);
      for (; c < static_cast<int32_t>(dots.cols()); ++c) {
        of_a.add(at, row[c], in_b + c);
        of_b.add(static_cast<size_t>(in_b + c), row[c], in_a);
      }
    }
  });
  return {of_a.list(), of_b.list()};
}

/// A match, and how alike its sides look.
struct Likeness {
  FeatureMatch match;
  float dot = 0;
};

// Each point at most once, where it looks most alike.
std::vector<FeatureMatch> unique_matches(std::vector<Likeness> found,
                                         const PhotoFeatures& a,
                                         const PhotoFeatures& b) {
  std::stable_sort(found.begin(), found.end(), [](const Likeness& l, const Likeness& r) {
    return l.dot > r.dot;
  });
  std::vector<char> in_a(a.points.size(), 0);
  std::vector<char> in_b(b.points.size(), 0);
  std::vector<FeatureMatch> out;
  for (const Likeness& l : found) {
    char& of_a = in_a[static_cast<size_t>(l.match.a)];
    char& of_b = in_b[static_cast<size_t>(l.match.b)];
    if (of_a != 0 || of_b != 0) continue;
    of_a = of_b = 1;
    out.push_back(l.match);
  }
  std::sort(out.begin(), out.end(), [](const FeatureMatch& l, const FeatureMatch& r) {
    return l.a < r.a;
  });
  return out;
}

}  // namespace

void FeatureOptions::validate() const {
  require(largest_side >= 64, "FeatureOptions.largest_side must be >= 64", largest_side);
  require(most >= 1, "FeatureOptions.most must be >= 1", most);
}

PhotoFeatures detect_features(const ColorImage& image,
                              const MaskMap& usable,
                              const FeatureOptions& options) {
  options.validate();
  const cv::Mat picture = grey_picture(image, options.largest_side);
  const auto detector = sift();
  std::vector<cv::KeyPoint> found;
  detector->detect(picture, found, mask_of(usable, picture.size()));
  sort_and_cut(found, static_cast<size_t>(options.most));
  cv::Mat descriptors;
  detector->compute(picture, found, descriptors);

  PhotoFeatures out;
  const ToPhotograph to_photograph(image, picture);
  out.pixel = to_photograph.pixel();
  out.picture = raster_of(picture);
  out.points.reserve(found.size());
  for (const cv::KeyPoint& p : found) out.points.push_back(to_photograph(p.pt));
  out.descriptors.resize(descriptors.rows, descriptors.cols);
  for (int i = 0; i < descriptors.rows; ++i) out.descriptors.row(i) = rooted(descriptors.row(i));
  return out;
}

PhotoFeatures detect_tilted_features(const ColorImage& image,
                                     const MaskMap& usable,
                                     const FeatureOptions& options,
                                     const Progress& progress) {
  options.validate();
  const cv::Mat picture = grey_picture(image, options.largest_side);
  const cv::Mat mask = mask_of(usable, picture.size());
  // Factor of compression, and its direction [degrees].
  constexpr float kTilt = 1.4142136f;
  constexpr std::array<std::pair<float, float>, 5> kViews = {
      {{1, 0}, {kTilt, 0}, {kTilt, 45}, {kTilt, 90}, {kTilt, 135}}};
  std::vector<Found> found;
  for (size_t view = 0; view < kViews.size(); ++view) {
    report(progress, double(view) / kViews.size());
    const auto detector = cv::AffineFeature::create(sift());
    detector->setViewParams({kViews[view].first}, {kViews[view].second});
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors;
    detector->detectAndCompute(picture, mask, points, descriptors);
    const cv::Point2f shift = shift_of_tilt(kViews[view].first, kViews[view].second);
    for (size_t i = 0; i < points.size(); ++i) {
      points[i].pt -= shift;
      found.push_back({points[i], descriptors.row(static_cast<int>(i))});
    }
  }
  sort_and_cut(found, 2 * static_cast<size_t>(options.most));

  PhotoFeatures out;
  const ToPhotograph to_photograph(image, picture);
  out.pixel = to_photograph.pixel();
  out.picture = raster_of(picture);
  Places places(picture.size());
  out.descriptors.resize(static_cast<Eigen::Index>(found.size()), sift()->descriptorSize());
  for (size_t i = 0; i < found.size(); ++i) {
    out.point_of.push_back(places.add(found[i].point.pt));
    out.descriptors.row(static_cast<Eigen::Index>(i)) = rooted(found[i].descriptor);
  }
  for (const cv::Point2f& at : places.points()) out.points.push_back(to_photograph(at));
  return out;
}

std::vector<FeatureMatch> match_features(const PhotoFeatures& a,
                                         const PhotoFeatures& b,
                                         const Progress& progress) {
  const auto [of_a, of_b] = a.point_of.empty() && b.point_of.empty()
                                ? nearest_of_points(a, b, progress)
                                : nearest_of_looks(a, b, progress);
  std::vector<Likeness> found;
  for (size_t i = 0; i < of_a.size(); ++i) {
    if (!of_a[i].is_distinct()) continue;
    const int in_a = point_of_row(a, static_cast<Eigen::Index>(i));
    const Nearest& back = of_b[static_cast<size_t>(of_a[i].row)];
    if (back.point == in_a && back.is_distinct()) {
      found.push_back({{in_a, of_a[i].point}, of_a[i].best});
    }
  }
  return unique_matches(std::move(found), a, b);
}

}  // namespace cgs
