// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/neighbours.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "libcgs/core/angle_between.h"
#include "libcgs/core/input_views.h"

namespace cgs {

namespace {

const Camera& input_camera(const Scene& scene, size_t input) {
  return scene.views[static_cast<size_t>(scene.input[input])].camera;
}

// What each view tells of places that one may show, from far to near: rows are places.
Eigen::MatrixXd worth_of_views(const Scene& scene,
                               size_t input,
                               const std::vector<size_t>& others) {
  constexpr int kGrid = 12;   // places per side of the picture
  constexpr int kDepths = 6;  // of each
  const Camera& own = input_camera(scene, input);
  const DepthRange range = depth_range(scene, scene.input[input]);
  Eigen::MatrixXd out =
      Eigen::MatrixXd::Zero(kGrid * kGrid * kDepths, static_cast<Eigen::Index>(others.size()));
  for (int i = 0; i < out.rows(); ++i) {
    const double u = (i % kGrid + 0.5) / kGrid * own.width;
    const double v = (i / kGrid % kGrid + 0.5) / kGrid * own.height;
    const int step = i / (kGrid * kGrid);
    const double rho = std::lerp(1 / range.far, 1 / range.near, (step + 0.5) / kDepths);
    const Eigen::Vector3d point = own.unproject(u, v, 1 / rho);
    for (int k = 0; k < out.cols(); ++k) {
      const Camera& other = input_camera(scene, others[static_cast<size_t>(k)]);
      if (!other.sees(other.project(point))) continue;
      out(i, k) = worth_of_angle(angle_between(own.center() - point, other.center() - point));
    }
  }
  return out;
}

}  // namespace

std::vector<size_t> neighbours(const Scene& scene, size_t input, size_t most) {
  std::vector<size_t> others;
  for (size_t j = 0; j < scene.input.size(); ++j) {
    if (j != input) others.push_back(j);
  }
  if (others.size() <= most) return others;
  const Eigen::MatrixXd worth = worth_of_views(scene, input, others);
  // Each adds what it tells of a place, the less the more is told already.
  Eigen::ArrayXd left = Eigen::ArrayXd::Ones(worth.rows());
  std::vector<size_t> out;
  while (out.size() < most) {
    double largest = 0;
    size_t best = 0;
    for (size_t k = 0; k < others.size(); ++k) {
      if (std::find(out.begin(), out.end(), others[k]) != out.end()) continue;
      const double gain = (worth.col(static_cast<Eigen::Index>(k)).array() * left).sum();
      if (gain > largest) std::tie(largest, best) = std::pair(gain, k);
    }
    if (!(largest > 0)) break;
    out.push_back(others[best]);
    left *= (-worth.col(static_cast<Eigen::Index>(best)).array()).exp();
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<std::pair<size_t, size_t>> neighbouring_pairs(const Scene& scene) {
  std::set<std::pair<size_t, size_t>> out;
  for (size_t a = 0; a < scene.input.size(); ++a) {
    for (const size_t b : neighbours(scene, a, kMostCompared)) out.insert(std::minmax(a, b));
  }
  return {out.begin(), out.end()};
}

}  // namespace cgs
