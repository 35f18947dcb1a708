// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/m3c2.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"
#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr uint32_t kFewest = 4;

/// The points that somebody saw, to be searched.
struct Cloud {
  explicit Cloud(const ComparedPoints& in) : tree(add_seen(in)) {}

  // Fills the vectors, and gives what the tree is made of.
  std::vector<Eigen::Vector3f> add_seen(const ComparedPoints& in) {
    std::vector<Eigen::Vector3f> out;
    for (size_t i = 0; i < in.places.size(); ++i) {
      if (in.observed[i] == 0) continue;
      points.push_back(in.places[i]);
      sigma.push_back(in.sigma[i]);
      if (!in.outward.empty()) outward.push_back(in.outward[i]);
      out.emplace_back(in.places[i].cast<float>());
    }
    return out;
  }

  std::vector<Eigen::Vector3d> points;
  std::vector<double> sigma;
  std::vector<Eigen::Vector3f> outward;  // empty = not known
  KdTree tree;                           // made last, while it fills the others
};

/// Points of one side within the cylinder, along its axis from the place.
struct Column {
  uint32_t count = 0;
  uint32_t stated = 0;  ///< Those that state a sigma.
  double mean = 0;
  double roughness = 0;
  double variance = kNone;  ///< Of the mean.
  bool is_split = false;
};

class Comparing {
 public:
  Comparing(const Cloud& a, const Cloud& b, const M3c2Options& options)
      : a_(a), b_(b), options_(options) {}

  M3c2Place at(const Eigen::Vector3d& place, const Eigen::Vector3f& outward) {
    M3c2Place out;
    out.distance = out.detection = kNone;
    const std::optional<Eigen::Vector3d> normal = normal_at(place);
    if (!normal) return out;
    const double side = normal->dot(outward.cast<double>()) < 0 ? -1 : 1;
    out.normal = (side * *normal).cast<float>();
    const bool has_sides = !a_.outward.empty() && !b_.outward.empty() && !outward.isZero(0);
    const Column in_a = column(a_, place, side * *normal, has_sides);
    const Column in_b = column(b_, place, side * *normal, has_sides);
    out.count_a = in_a.count;
    out.count_b = in_b.count;
    out.stated_a = in_a.stated;
    out.stated_b = in_b.stated;
    out.roughness_a = in_a.roughness;
    out.roughness_b = in_b.roughness;
    out.is_split = in_a.is_split || in_b.is_split;
    if (in_a.count == 0 || in_b.count == 0) return out;
    out.distance = in_a.mean - in_b.mean;
    if (in_a.count < kFewest || in_b.count < kFewest) return out;
    constexpr double kOf95Percent = 1.96;
    const double of_scale = options_.scale_sigma * normal->dot(place - options_.center);
    out.detection = kOf95Percent * (std::sqrt(in_a.variance + in_b.variance + of_scale * of_scale) +
                                    options_.registration);
    out.change = std::abs(out.distance) <= out.detection ? Change::None
                 : out.distance < 0                      ? Change::Nearer
                                                         : Change::Farther;
    return out;
  }

 private:
  // The direction in which A's points around spread least.
  std::optional<Eigen::Vector3d> normal_at(const Eigen::Vector3d& place) {
    a_.tree.within(place.cast<float>(), static_cast<float>(0.5 * options_.normal_scale), near_);
    if (near_.size() < kFewest) return std::nullopt;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    for (const Neighbor& n : near_) {
      const Eigen::Vector3d d = a_.points[n.point] - place;
      sum += d;
      products += d * d.transpose();
    }
    const Eigen::Matrix3d spread = products - sum * sum.transpose() / double(near_.size());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    constexpr double kLine = 1e-9;  // of the longest extent, squared
    if (!(solver.eigenvalues()[1] > kLine * solver.eigenvalues()[2])) return std::nullopt;
    return solver.eigenvectors().col(0);
  }

  // The tree knows balls: a chain of them covers the cylinder, each for its own slice. Where the
  // cloud `has_sides`, points that look against the axis are left out.
  Column column(const Cloud& cloud,
                const Eigen::Vector3d& place,
                const Eigen::Vector3d& axis,
                bool has_sides) {
    const double radius = 0.5 * options_.cylinder;
    const int slices = std::max(1, static_cast<int>(std::ceil(options_.depth / radius)));
    const double slice = 2 * options_.depth / slices;
    // More by what the tree loses where it rounds the points and the middle to float.
    constexpr double kRounding = 4 * double(std::numeric_limits<float>::epsilon());
    const double farthest = place.cwiseAbs().maxCoeff() + options_.depth + radius;
    const auto ball =
        static_cast<float>(std::hypot(radius, 0.5 * slice) * (1 + 1e-5) + kRounding * farthest);
    along_.clear();
    double squares = 0;
    uint32_t stated = 0;
    const auto edge = [&](int k) { return slice * k - options_.depth; };
    for (int k = 0; k < slices; ++k) {
      const double low = edge(k);
      const double high = edge(k + 1);
      cloud.tree.within((place + (low + 0.5 * slice) * axis).cast<float>(), ball, near_);
      for (const Neighbor& n : near_) {
        const Eigen::Vector3d way = cloud.points[n.point] - place;
        const double along = axis.dot(way);
        if (along < low || along >= high) continue;
        if ((way - along * axis).squaredNorm() > radius * radius) continue;
        if (has_sides && cloud.outward[n.point].cast<double>().dot(axis) < 0) continue;
        along_.push_back(along);
        const double sigma = cloud.sigma[n.point];
        if (!std::isfinite(sigma)) continue;
        squares += sigma * sigma;
        ++stated;
      }
    }
    return summary(squares, stated);
  }

  Column summary(double sigma_squares, uint32_t stated) {
    Column out;
    out.count = static_cast<uint32_t>(along_.size());
    out.stated = stated;
    if (along_.empty()) return out;
    const auto n = static_cast<double>(along_.size());
    for (const double d : along_) out.mean += d / n;
    for (const double d : along_) out.roughness += (d - out.mean) * (d - out.mean);
    out.roughness = along_.size() > 1 ? std::sqrt(out.roughness / (n - 1)) : 0;
    const double by_roughness = out.roughness * out.roughness / n;
    const double by_sigma = stated > 0 ? sigma_squares / stated : 0;
    out.variance = stated == out.count ? by_sigma : std::max(by_sigma, by_roughness);
    out.is_split = has_gap();
    return out;
  }

  // Sorts what the column holds.
  bool has_gap() {
    std::sort(along_.begin(), along_.end());
    return std::adjacent_find(along_.begin(), along_.end(), [&](double low, double high) {
             return high - low > options_.cylinder;
           }) != along_.end();
  }

  const Cloud& a_;
  const Cloud& b_;
  const M3c2Options& options_;
  std::vector<Neighbor> near_;
  std::vector<double> along_;
};

// Twice the median distance of a point to its 30th neighbour, by some of the points.
double width_of_thirty(const Cloud& cloud) {
  if (cloud.points.size() < 2) return 0;
  constexpr size_t kPoints = 30;
  constexpr size_t kAsked = 2000;
  const size_t step = std::max<size_t>(1, cloud.points.size() / kAsked);
  std::vector<float> squares;
  std::vector<Neighbor> found;
  for (size_t i = 0; i < cloud.points.size(); i += step) {
    cloud.tree.nearest(cloud.points[i].cast<float>(), kPoints, found);
    squares.push_back(found.back().squared_distance);
  }
  return 2 * std::sqrt(double{median(squares)});
}

}  // namespace

void M3c2Options::validate() const {
  const auto is_length = [](double x) { return x > 0 && std::isfinite(x); };
  require(is_length(normal_scale), "M3c2Options.normal_scale must be above 0", normal_scale);
  require(is_length(cylinder), "M3c2Options.cylinder must be above 0", cylinder);
  require(is_length(depth), "M3c2Options.depth must be above 0", depth);
  constexpr double kLongest = 1000;
  require(depth <= kLongest * cylinder,
          "M3c2Options.depth must be at most 1000 times the cylinder's diameter",
          depth);
  require(registration >= 0 && std::isfinite(registration),
          "M3c2Options.registration must be 0 or more",
          registration);
  require(scale_sigma >= 0 && std::isfinite(scale_sigma),
          "M3c2Options.scale_sigma must be 0 or more",
          scale_sigma);
}

double spacing_cylinder(const ComparedPoints& a, const ComparedPoints& b) {
  const auto width_of = [](const ComparedPoints& points) {
    const bool is_seen = std::find(points.observed.begin(), points.observed.end(), uint8_t{1}) !=
                         points.observed.end();
    return is_seen ? width_of_thirty(Cloud(points)) : 0;
  };
  const double wide = std::max(width_of(a), width_of(b));
  require(wide > 0, "a comparison of clouds needs points that were seen, their spacing", wide);
  return wide;
}

M3c2Options m3c2_scales(double cylinder) {
  M3c2Options out;
  out.cylinder = cylinder;
  out.normal_scale = 2 * out.cylinder;
  out.depth = 10 * out.cylinder;
  return out;
}

std::vector<M3c2Place> m3c2(const std::vector<Eigen::Vector3d>& places,
                            const std::vector<Eigen::Vector3f>& outward,
                            const ComparedPoints& a,
                            const ComparedPoints& b,
                            const M3c2Options& options) {
  options.validate();
  require(outward.size() == places.size(), "m3c2 needs a direction per place", outward.size());
  for (const ComparedPoints* side : {&a, &b}) {
    require(side->outward.empty() || side->outward.size() == side->places.size(),
            "m3c2 needs a side per point, or none, their number",
            side->outward.size());
  }
  const Cloud cloud_a(a);
  const Cloud cloud_b(b);
  const size_t fewer = std::min(cloud_a.points.size(), cloud_b.points.size());
  require(fewer > 0, "m3c2 needs points that were seen in both clouds, their number", fewer);
  std::vector<M3c2Place> out(places.size());
  constexpr size_t kGrain = 256;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, places.size(), kGrain), [&](const auto& range) {
    Comparing comparing(cloud_a, cloud_b, options);
    for (size_t i = range.begin(); i < range.end(); ++i) {
      out[i] = comparing.at(places[i], outward[i]);
    }
  });
  return out;
}

}  // namespace cgs
