// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/measured_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "libcgs/core/order_statistics.h"
#include "libcgs/core/split_mix.h"

namespace cgs {

namespace {

using Eigen::Vector3d;
using Plane = Eigen::Hyperplane<double, 3>;
using Indices = std::vector<size_t>;

// A measured pixel.
struct Sample {
  size_t view;
  int x, y;
  double depth;
  Vector3d at;
  Vector3d ray;     // unit vector from its camera
  Vector3d normal;  // of the surface around; zero = not known
};

double tolerance(const Plane& plane, const Vector3d& ray, double depth) {
  constexpr double kAlongRay = 0.02;
  constexpr double kAcross = 0.005;
  return depth * (kAlongRay * std::abs(plane.normal().dot(ray)) + kAcross);
}

double distance(const Plane& plane, const Sample& s) {
  return plane.absDistance(s.at) / tolerance(plane, s.ray, s.depth);
}

// Weighted points, as differences from a place among them.
class Spread {
 public:
  void add(const Vector3d& d, double weight = 1) {
    sum_ += weight * d;
    squares_ += weight * d * d.transpose();
    weight_ += weight;
  }
  double weight() const { return weight_; }
  Vector3d mean() const { return sum_ / weight_; }
  // Across their plane of least squares.
  Vector3d normal() const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares_ -
                                                              sum_ * sum_.transpose() / weight_);
    return axes.eigenvectors().col(0);
  }

 private:
  Vector3d sum_ = Vector3d::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();
  double weight_ = 0;
};

// Of the measured surface around a pixel; zero where too little is.
Vector3d normal_around(const Camera& camera, const ViewPriors& priors, int x0, int y0) {
  constexpr int kReach = 4;
  constexpr int kFewest = 10;
  Spread around;
  const double z0 = double{priors.depth(x0, y0)};
  const Vector3d centre = camera.unproject(x0 + 0.5, y0 + 0.5, z0);
  for (int y = std::max(0, y0 - kReach); y <= std::min(priors.depth.height - 1, y0 + kReach); ++y) {
    for (int x = std::max(0, x0 - kReach); x <= std::min(priors.depth.width - 1, x0 + kReach);
         ++x) {
      if (priors.origin(x, y) != DepthOrigin::Measured) continue;
      around.add(camera.unproject(x + 0.5, y + 0.5, double{priors.depth(x, y)}) - centre);
    }
  }
  return around.weight() < kFewest ? Vector3d(Vector3d::Zero()) : around.normal();
}

// Distance of samples, so that there are about as many as are needed to tell planes [pixels].
int sample_step(const std::vector<ViewPriors>& priors) {
  constexpr double kWanted = 8'000;
  constexpr double kPerView = 150;
  double measured = 0;
  for (const ViewPriors& p : priors) {
    measured +=
        double(std::count(p.origin.data.begin(), p.origin.data.end(), DepthOrigin::Measured));
  }
  const double wanted = std::max(kWanted, kPerView * double(priors.size()));
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(measured / wanted))));
}

// Measured pixels on a grid, view by view.
std::vector<Sample> samples_of(const Scene& scene,
                               const std::vector<ViewPriors>& priors,
                               int step) {
  std::vector<Sample> out;
  for (size_t v = 0; v < priors.size(); ++v) {
    const Camera& camera = scene.views[static_cast<size_t>(scene.input[v])].camera;
    const ViewPriors& p = priors[v];
    for (int y = step / 2; y < p.depth.height; y += step) {
      for (int x = step / 2; x < p.depth.width; x += step) {
        if (p.origin(x, y) != DepthOrigin::Measured) continue;
        const double depth = double{p.depth(x, y)};
        const Vector3d at = camera.unproject(x + 0.5, y + 0.5, depth);
        out.push_back({v,
                       x,
                       y,
                       depth,
                       at,
                       (at - camera.center()).normalized(),
                       normal_around(camera, p, x, y)});
      }
    }
  }
  return out;
}

class PlaneSearch {
 public:
  PlaneSearch(std::vector<Sample> samples, const Vector3d& up, int reach)
      : samples_(std::move(samples)), up_(up), reach_(reach), left_(samples_.size()) {
    for (size_t i = 0; i < left_.size(); ++i) left_[i] = i;
  }

  // Of what is left the plane that most lies on, which is taken out; none if that is too few.
  std::optional<std::pair<Plane, Indices>> take_next(uint64_t number) {
    constexpr double kLeastShare = 0.04;
    constexpr size_t kFewest = 40;
    constexpr int kFits = 3;
    std::optional<Plane> plane = best_of_trials(number);
    if (!plane) return std::nullopt;
    for (int k = 0; k < kFits; ++k) *plane = fitted(*plane);
    Indices on = left_on(*plane);
    const double least = kLeastShare * double(samples_.size());
    if (on.size() < kFewest || double(on.size()) < least) return std::nullopt;
    std::erase_if(left_, [&](size_t i) { return distance(*plane, samples_[i]) <= 1; });
    return std::pair(*plane, std::move(on));
  }

  // Ground or a wall; neither if there is a doubt.
  std::optional<MeasuredPlane> told(const Plane& plane, const Indices& on) const {
    constexpr double kUpright = 0.15;
    constexpr double kHardly = 0.12;
    constexpr double kLittle = 0.35;
    constexpr double kOfGround = 0.5;
    constexpr double kOfWall = 0.6;
    const double beside = this->beside(plane);
    const double alike = double(count_alike(plane, on)) / double(on.size());
    if (std::abs(plane.normal().dot(up_)) > kLevel) {
      Plane upwards = plane;
      if (plane.normal().dot(up_) < 0) upwards.coeffs() = -plane.coeffs();
      const bool is_ground = (beside < kHardly || alike > kOfGround) && !has_more_below(upwards);
      if (!is_ground) return std::nullopt;
      return MeasuredPlane{upwards, -std::numeric_limits<double>::infinity()};
    }
    if (std::abs(plane.normal().dot(up_)) > kUpright) return std::nullopt;
    const bool is_wall = beside < kHardly || (beside < kLittle && alike > kOfWall) || is_long(on);
    if (!is_wall) return std::nullopt;
    return MeasuredPlane{plane, lowest(on)};
  }

 private:
  static constexpr uint64_t kDraws = 64;
  static constexpr double kLevel = 0.98;  // least cosine: pictures tell up to some degrees only

  // Through two samples: upright, or as level as may be.
  std::optional<Plane> plane_of_trial(uint64_t number, uint64_t trial) const {
    return trial % 2 == 0 ? level_plane(number, trial) : upright_plane(number, trial);
  }

  const Sample& drawn(uint64_t number, uint64_t trial, uint64_t k) const {
    return samples_[left_[random_number((number << 32U) + kDraws * trial + k) % left_.size()]];
  }

  std::optional<Plane> level_plane(uint64_t number, uint64_t trial) const {
    constexpr double kTurnedUp = 0.87;
    const Sample* first = nullptr;
    for (uint64_t k = 0; k < kDraws; ++k) {
      const Sample& s = drawn(number, trial, k);
      if (!(std::abs(s.normal.dot(up_)) > kTurnedUp)) continue;
      if (first == nullptr) {
        first = &s;
        continue;
      }
      const Vector3d along = (s.at - first->at).normalized();
      const Vector3d normal = up_ - up_.dot(along) * along;
      if (normal.norm() > kLevel) return Plane(normal.normalized(), s.at);
    }
    return std::nullopt;
  }

  std::optional<Plane> upright_plane(uint64_t number, uint64_t trial) const {
    const Sample& a = drawn(number, trial, 0);
    const auto [first, last] = of_view(a.view);
    for (uint64_t k = 1; k < kDraws; ++k) {
      const uint64_t drawn = random_number((number << 32U) + kDraws * trial + k);
      const Sample& b = samples_[left_[first + drawn % (last - first)]];
      if (std::abs(b.x - a.x) > reach_ || std::abs(b.y - a.y) > reach_) continue;
      const Vector3d normal = (b.at - a.at).cross(up_);
      if (normal.norm() > 0) return Plane(normal.normalized(), a.at);
    }
    return std::nullopt;
  }

  // Where the samples of a view are among those that are left; there is one.
  std::pair<size_t, size_t> of_view(size_t view) const {
    const auto is_before = [&](size_t i, size_t v) { return samples_[i].view < v; };
    const auto first = std::lower_bound(left_.begin(), left_.end(), view, is_before);
    const auto last = std::lower_bound(first, left_.end(), view + 1, is_before);
    return {first - left_.begin(), last - left_.begin()};
  }

  std::optional<Plane> best_of_trials(uint64_t number) const {
    constexpr size_t kTrials = 2000;
    if (left_.empty()) return std::nullopt;
    std::vector<size_t> scores(kTrials, 0);
    tbb::parallel_for(size_t(0), kTrials, [&](size_t trial) {
      const auto plane = plane_of_trial(number, trial);
      if (!plane) return;
      const Indices on = left_on(*plane);
      scores[trial] = on.size() + count_alike(*plane, on);
    });
    const auto best = std::max_element(scores.begin(), scores.end());
    return plane_of_trial(number, static_cast<uint64_t>(best - scores.begin()));
  }

  Indices left_on(const Plane& plane) const {
    Indices out;
    for (const size_t i : left_) {
      if (distance(plane, samples_[i]) <= 1) out.push_back(i);
    }
    return out;
  }

  // Least squares through what is left of the samples on it, relative to their depths.
  Plane fitted(const Plane& plane) const {
    Spread spread;
    const Vector3d& centre = samples_.front().at;
    for (const size_t i : left_on(plane)) {
      spread.add(samples_[i].at - centre, 1 / samples_[i].depth);
    }
    if (!(spread.weight() > 0)) return plane;
    return {spread.normal(), Vector3d(centre + spread.mean())};
  }

  // How much lies just beside it, of what lies on it.
  double beside(const Plane& plane) const {
    size_t on = 0;
    size_t beside = 0;
    for (const Sample& s : samples_) {
      const double away = distance(plane, s);
      on += away <= 1 ? 1 : 0;
      beside += away > 1 && away <= 2 ? 1 : 0;
    }
    return double(beside) / double(on);
  }

  // Those that are turned like it.
  size_t count_alike(const Plane& plane, const Indices& on) const {
    static const double kLeast = std::cos(20 * std::numbers::pi / 180);
    return static_cast<size_t>(std::count_if(on.begin(), on.end(), [&](size_t i) {
      return std::abs(samples_[i].normal.dot(plane.normal())) > kLeast;
    }));
  }

  // Whether in half of the views it goes from near to far.
  bool is_long(const Indices& on) const {
    constexpr size_t kFewest = 10;
    constexpr double kLong = 4;
    std::vector<std::vector<double>> depths;
    for (const size_t i : on) {
      depths.resize(std::max(depths.size(), samples_[i].view + 1));
      depths[samples_[i].view].push_back(samples_[i].depth);
    }
    std::vector<double> ratios;
    for (std::vector<double>& of_view : depths) {
      if (of_view.size() < kFewest) continue;
      const double near = quantile(of_view, 0.1);
      ratios.push_back(quantile(of_view, 0.9) / near);
    }
    return !ratios.empty() && median(ratios) >= kLong;
  }

  double lowest(const Indices& on) const {
    constexpr double kOutliers = 0.02;
    std::vector<double> heights;
    for (const size_t i : on) heights.push_back(samples_[i].at.dot(up_));
    return quantile(heights, kOutliers);
  }

  // \pre the normal points up
  bool has_more_below(const Plane& plane) const {
    constexpr double kMost = 0.05;
    constexpr double kBelow = 0.02;  // of the depth
    const auto below = std::count_if(samples_.begin(), samples_.end(), [&](const Sample& s) {
      return plane.signedDistance(s.at) < -kBelow * s.depth;
    });
    return double(below) > kMost * double(samples_.size());
  }

  std::vector<Sample> samples_;
  Vector3d up_;
  int reach_;     // of the second sample of a wall from the first [pixels]
  Indices left_;  // on no plane yet, ascending
};

}  // namespace

size_t plane_of(
    const std::vector<MeasuredPlane>& planes, const Camera& camera, int x, int y, double depth) {
  const Vector3d point = camera.unproject(x + 0.5, y + 0.5, depth);
  const Vector3d ray = (point - camera.center()).normalized();
  const auto found = std::find_if(planes.begin(), planes.end(), [&](const MeasuredPlane& plane) {
    return plane.plane.absDistance(point) <= tolerance(plane.plane, ray, depth);
  });
  return static_cast<size_t>(found - planes.begin());
}

std::vector<MeasuredPlane> measured_planes(const Scene& scene,
                                           const std::vector<ViewPriors>& priors) {
  constexpr uint64_t kMost = 10;
  std::vector<MeasuredPlane> out;
  if (!scene.frame.knows_up()) return out;
  int longest = 0;
  for (const ViewPriors& p : priors) longest = std::max({longest, p.depth.width, p.depth.height});
  const int step = sample_step(priors);
  const int reach = std::max(longest / 10, 3 * step);
  PlaneSearch search(samples_of(scene, priors, step), scene.frame.up, reach);
  for (uint64_t k = 0; k < kMost; ++k) {
    const auto next = search.take_next(k);
    if (!next) break;
    if (auto plane = search.told(next->first, next->second)) out.push_back(*plane);
  }
  return out;
}

}  // namespace cgs
