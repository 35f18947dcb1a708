// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <ceres/ceres.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/priors/neighbours.h"

namespace cgs {

namespace {

constexpr size_t kFewestPoints = 50;  // per view; below, two unknowns are not worth trusting
constexpr double kCap = 4;            // of residuals in the report [loss scales]

const Camera& input_camera(const Scene& scene, size_t input) {
  return scene.views[static_cast<size_t>(scene.input[input])].camera;
}

// Where a pixel of known inverse depth appears in another view: (A p + rho b), dehomogenised.
struct Transfer {
  Eigen::Matrix3d A;
  Eigen::Vector3d b;

  Transfer(const Camera& from, const Camera& to) {
    const Eigen::Isometry3d to_from = to.cam_from_world() * from.world_from_cam;
    A = to.intrinsics() * to_from.rotation() * from.intrinsics().inverse();
    b = to.intrinsics() * to_from.translation();
  }
  Eigen::Vector3d operator()(const Eigen::Vector2d& p, double rho) const {
    return A * p.homogeneous() + rho * b;
  }
};

// Inverse depth at an image point, bilinear; NaN where a neighbour is unknown or on another
// surface.
double inverse_depth_at(const DepthMap& depth, const Eigen::Vector2d& p) {
  const int x = static_cast<int>(std::floor(p.x() - 0.5));
  const int y = static_cast<int>(std::floor(p.y() - 0.5));
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (!depth.contains(x, y) || !depth.contains(x + 1, y + 1)) return kNaN;
  const std::array<double, 4> rho = {1 / double(depth(x, y)),
                                     1 / double(depth(x + 1, y)),
                                     1 / double(depth(x, y + 1)),
                                     1 / double(depth(x + 1, y + 1))};
  const auto [least, largest] = std::minmax_element(rho.begin(), rho.end());
  constexpr double kSameSurface = 0.05;
  if (!(*largest - *least <= kSameSurface * *largest)) return kNaN;
  const double a = p.x() - 0.5 - x;
  const double b = p.y() - 0.5 - y;
  return (1 - b) * ((1 - a) * rho[0] + a * rho[1]) + b * ((1 - a) * rho[2] + a * rho[3]);
}

// One end of a correspondence: a point with inverse depth, and where it must appear.
struct Observation {
  size_t view;
  double rho;
  Eigen::Vector3d at_infinity;  // A p
  Eigen::Vector3d b;
  Eigen::Vector2d target;

  double residual(double scale, double offset) const {
    const Eigen::Vector3d h = at_infinity + (scale * rho + offset) * b;
    return h.z() > 0 ? (h.head<2>() / h.z() - target).norm()
                     : std::numeric_limits<double>::infinity();
  }
};

struct Projection {
  const Observation* point;

  template <typename T>
  bool operator()(const T* scale_offset, T* residual) const {
    const T rho = scale_offset[0] * T(point->rho) + scale_offset[1];
    const T z = T(point->at_infinity.z()) + rho * T(point->b.z());
    if (!(z > T(0))) return false;
    for (int k = 0; k < 2; ++k) {
      residual[k] = (T(point->at_infinity[k]) + rho * T(point->b[k])) / z - T(point->target[k]);
    }
    return true;
  }
};

std::vector<Observation> observations(const Scene& scene,
                                      const std::vector<ViewPriors>& priors,
                                      const std::vector<Correspondence>& correspondences) {
  std::vector<Observation> out;
  const auto add = [&](int from, int to, const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    const auto i = static_cast<size_t>(from);
    const double rho = inverse_depth_at(priors[i].depth, p);
    if (!(rho > 0)) return;
    const Transfer transfer(input_camera(scene, i), input_camera(scene, static_cast<size_t>(to)));
    const Observation point{i, rho, transfer(p, 0), transfer.b, q};
    if (std::isfinite(point.residual(1, 0))) out.push_back(point);
  };
  for (const Correspondence& c : correspondences) {
    add(c.view_a, c.view_b, c.point_a, c.point_b);
    add(c.view_b, c.view_a, c.point_b, c.point_a);
  }
  return out;
}

using ScaleOffset = std::array<double, 2>;

double capped_rms(const std::vector<Observation>& points,
                  const std::vector<ScaleOffset>& solution,
                  double cap) {
  double sum = 0;
  for (const Observation& p : points) {
    const double r = std::min(cap, p.residual(solution[p.view][0], solution[p.view][1]));
    sum += r * r;
  }
  return points.empty() ? 0 : std::sqrt(sum / static_cast<double>(points.size()));
}

// Of some views, whose observations alone count: those of others do not depend on their depth.
void solve(const std::vector<Observation>& points,
           size_t first,
           size_t last,
           double loss_scale,
           std::vector<ScaleOffset>& solution) {
  ceres::Problem problem;
  std::vector<size_t> count(solution.size(), 0);
  for (const Observation& p : points) ++count[p.view];
  for (const Observation& p : points) {
    if (p.view < first || p.view >= last || count[p.view] < kFewestPoints) continue;
    // The loss is per block, so every point needs its own.
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Projection, 2, 2>(new Projection{&p}),
                             new ceres::CauchyLoss(loss_scale),
                             solution[p.view].data());
  }
  if (problem.NumResidualBlocks() == 0) return;
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;  // sums in one order: same bits every time
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

void solve(const std::vector<Observation>& points,
           double loss_scale,
           std::vector<ScaleOffset>& solution) {
  constexpr size_t kTogether = 4;  // views; the matrix of all would be dense, and nearly all zero
  const size_t groups = (solution.size() + kTogether - 1) / kTogether;
  tbb::parallel_for(size_t{0}, groups, [&](size_t i) {
    const size_t last = std::min(solution.size(), (i + 1) * kTogether);
    solve(points, i * kTogether, last, loss_scale, solution);
  });
}

void move_depths(const ScaleOffset& solution, ViewPriors& priors) {
  for (size_t i = 0; i < priors.depth.data.size(); ++i) {
    float& depth = priors.depth.data[i];
    if (!(depth > 0)) continue;
    const double rho = solution[0] / double(depth) + solution[1];
    if (rho > 0) {
      const double gain = solution[0] / (rho * rho * double(depth) * double(depth));
      priors.sigma.data[i] = static_cast<float>(double(priors.sigma.data[i]) * gain);
      depth = static_cast<float>(1 / rho);
    } else if (priors.origin.data[i] == DepthOrigin::Measured) {
      depth = priors.sigma.data[i] = std::numeric_limits<float>::quiet_NaN();
      priors.origin.data[i] = DepthOrigin::Unknown;
      priors.matched_views.data[i] = 0;
    }
  }
}

}  // namespace

void AlignmentOptions::validate() const {
  require(loss_scale > 0, "AlignmentOptions.loss_scale must be > 0", loss_scale);
  require(max_disagreement > 0, "AlignmentOptions.max_disagreement must be > 0", max_disagreement);
  require(max_correspondences >= 1,
          "AlignmentOptions.max_correspondences must be >= 1",
          max_correspondences);
}

std::vector<Correspondence> depth_correspondences(const Scene& scene,
                                                  const std::vector<ViewPriors>& priors,
                                                  const AlignmentOptions& options) {
  options.validate();
  std::vector<Correspondence> out;
  for (size_t i = 0; i < priors.size(); ++i) {
    const DepthMap& depth = priors[i].depth;
    const double share = double(depth.data.size()) / options.max_correspondences;
    const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(share))));
    for (const size_t j : neighbours(scene, i, kMostCompared)) {
      const Transfer there(input_camera(scene, i), input_camera(scene, j));
      const Transfer back(input_camera(scene, j), input_camera(scene, i));
      for (int y = step / 2; y < depth.height; y += step) {
        for (int x = step / 2; x < depth.width; x += step) {
          if (priors[i].origin(x, y) != DepthOrigin::Measured) continue;
          const Eigen::Vector2d p(x + 0.5, y + 0.5);
          const Eigen::Vector3d h = there(p, 1 / double(depth(x, y)));
          if (!(h.z() > 0)) continue;
          const Eigen::Vector2d q = h.head<2>() / h.z();
          const Eigen::Vector3d g = back(q, inverse_depth_at(priors[j].depth, q));
          if (!(g.z() > 0) || (g.head<2>() / g.z() - p).norm() > options.max_disagreement) continue;
          out.push_back({static_cast<int>(i), static_cast<int>(j), p, q});
        }
      }
    }
  }
  return out;
}

AlignmentReport align_depths(const Scene& scene,
                             std::vector<ViewPriors>& priors,
                             const std::vector<Correspondence>& correspondences,
                             const AlignmentOptions& options) {
  options.validate();
  const std::vector<Observation> points = observations(scene, priors, correspondences);
  const double cap = kCap * options.loss_scale;
  const std::vector<ScaleOffset> start(priors.size(), ScaleOffset{1, 0});
  std::vector<ScaleOffset> solution = start;
  solve(points, options.loss_scale, solution);
  AlignmentReport report;
  report.correspondences = correspondences.size();
  report.rms_before = capped_rms(points, start, cap);
  report.rms_after = capped_rms(points, solution, cap);
  const bool positive =
      std::all_of(solution.begin(), solution.end(), [](const ScaleOffset& s) { return s[0] > 0; });
  if (!positive || !(report.rms_after < report.rms_before)) {
    solution = start;
    report.rms_after = report.rms_before;
  }
  for (size_t i = 0; i < priors.size(); ++i) {
    if (solution[i] != start[i]) move_depths(solution[i], priors[i]);
    report.scale.push_back(solution[i][0]);
    report.offset.push_back(solution[i][1]);
  }
  return report;
}

AlignmentReport align_depths(const Scene& scene,
                             std::vector<ViewPriors>& priors,
                             const AlignmentOptions& options) {
  return align_depths(scene, priors, depth_correspondences(scene, priors, options), options);
}

}  // namespace cgs
