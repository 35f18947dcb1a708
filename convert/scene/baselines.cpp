// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/baselines.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numbers>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

/// The cells of a picture that hold one of some points.
class CoveredCells {
 public:
  explicit CoveredCells(const Camera& camera)
      : camera_(camera), cam_from_world_(camera.cam_from_world()) {}

  void add(const Eigen::Vector3d& point) {
    const Eigen::Vector3d uvz = camera_.project_in_cam(cam_from_world_ * point);
    if (!camera_.sees(uvz)) return;
    const auto column = static_cast<size_t>(uvz.x() / camera_.width * kColumns);
    const auto row = static_cast<size_t>(uvz.y() / camera_.height * kRows);
    holds_.set(std::min(row, kRows - 1) * kColumns + std::min(column, kColumns - 1));
  }
  double share() const { return double(holds_.count()) / double(holds_.size()); }

 private:
  static constexpr size_t kColumns = 8;
  static constexpr size_t kRows = 6;
  const Camera& camera_;
  Eigen::Isometry3d cam_from_world_;
  std::bitset<kColumns * kRows> holds_;
};

}  // namespace

Overlap overlap(const Scene& scene, int a, int b) {
  CoveredCells of_a(scene.views[static_cast<size_t>(a)].camera);
  CoveredCells of_b(scene.views[static_cast<size_t>(b)].camera);
  Overlap out;
  for (const SparsePoint& point : scene.points) {
    const auto shows = [&](int view) {
      return std::find(point.views.begin(), point.views.end(), view) != point.views.end();
    };
    if (!shows(a) || !shows(b)) continue;
    ++out.points;
    of_a.add(point.position);
    of_b.add(point.position);
  }
  out.share = std::min(of_a.share(), of_b.share());
  return out;
}

std::vector<Baseline> baselines(const Scene& scene) {
  std::vector<Baseline> out;
  const std::vector<DepthRange> ranges = depth_ranges(scene);
  for (size_t i = 0; i < scene.input.size(); ++i) {
    const double middle = 2 / (1 / ranges[i].near + 1 / ranges[i].far);
    for (size_t j = i + 1; j < scene.input.size(); ++j) {
      const Camera& a = scene.views[static_cast<size_t>(scene.input[i])].camera;
      const Camera& b = scene.views[static_cast<size_t>(scene.input[j])].camera;
      const double length = (a.center() - b.center()).norm();
      const double cosine =
          a.world_from_cam.rotation().col(2).dot(b.world_from_cam.rotation().col(2));
      out.push_back({scene.input[i],
                     scene.input[j],
                     length,
                     length / middle,
                     std::acos(std::clamp(cosine, -1.0, 1.0))});
    }
  }
  return out;
}

std::vector<std::string> baseline_warnings(const Scene& scene) {
  constexpr double kWide = std::numbers::pi / 3;
  constexpr double kLittle = 0.02;
  std::vector<std::string> out;
  double largest = 0;
  const auto name = [&](int view) {
    return printable(scene.views[static_cast<size_t>(view)].name);
  };
  const std::vector<Baseline> pairs = baselines(scene);
  // Ends of a walk around a thing may be far apart, if others lie between.
  std::vector<bool> has_company(scene.views.size(), false);
  for (const Baseline& pair : pairs) {
    if (pair.angle > kWide) continue;
    has_company[static_cast<size_t>(pair.a)] = has_company[static_cast<size_t>(pair.b)] = true;
  }
  for (const Baseline& pair : pairs) {
    largest = std::max(largest, pair.to_depth);
    const bool have_company =
        has_company[static_cast<size_t>(pair.a)] && has_company[static_cast<size_t>(pair.b)];
    if (pair.angle <= kWide || have_company) continue;
    out.push_back("views " + name(pair.a) + " and " + name(pair.b) +
                  " look in directions more than 60 degrees apart; they may share too little");
  }
  if (scene.input.size() > 1 && largest < kLittle) {
    out.emplace_back("the largest baseline is below 2 % of the depth; depth will be uncertain");
  }
  return out;
}

}  // namespace cgs
