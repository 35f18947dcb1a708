// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

constexpr std::array<std::pair<SceneKind, const char*>, 13> kSceneKinds = {
    {{SceneKind::Unknown, ""},
     {SceneKind::Llff, "LLFF"},
     {SceneKind::TransformsJson, "transforms.json"},
     {SceneKind::Colmap, "COLMAP"},
     {SceneKind::Strecha, "Strecha"},
     {SceneKind::Polycam, "Polycam"},
     {SceneKind::RgbdFrames, "RGB-D frames"},
     {SceneKind::Open3dRgbd, "Open3D RGB-D"},
     {SceneKind::Metashape, "Metashape"},
     {SceneKind::RealityCapture, "RealityCapture"},
     {SceneKind::CamerasJson, "cameras.json"},
     {SceneKind::ForeignCameras, "cameras.json"},
     {SceneKind::Photographs, "photographs"}}};

constexpr double kOrderQuantile = 0.01;  // of sparse points trimmed on each side, as outliers

double nearest_rank(std::vector<double> values, double q) {
  const auto k = static_cast<size_t>(std::lround(q * static_cast<double>(values.size() - 1)));
  return nth_smallest(values, k);
}

// Coordinates may be large and the scene small: points are subtracted before they are turned, which
// loses nothing, while rotating each by itself would round both.
Eigen::Vector3d project_offset(const Camera& camera, const Eigen::Vector3d& from_center) {
  return camera.project_in_cam(camera.world_from_cam.linear().transpose() * from_center);
}

// z-depths of the sparse points in front of a camera and inside its image.
std::vector<double> point_depths(const Scene& scene, const Camera& camera) {
  std::vector<double> depths;
  for (const SparsePoint& point : scene.points) {
    const Eigen::Vector3d uvz = project_offset(camera, point.position - camera.center());
    if (camera.sees(uvz)) depths.push_back(uvz.z());
  }
  return depths;
}

// Least-squares point closest to all optical axes, seen from a place near the cameras;
// nullopt-like NaN if they are parallel.
Eigen::Vector3d convergence_from(const Eigen::Vector3d& place, const Scene& scene) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const int i : scene.input) {
    const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    const Eigen::Vector3d axis = camera.world_from_cam.rotation().col(2);
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    A += P;
    b += P * (camera.center() - place);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A);
  if (eigen.eigenvalues()[0] < 1e-4 * eigen.eigenvalues()[2]) {
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return A.ldlt().solve(b);
}

// `median_of` gives the median baseline when it is needed: of many views it takes its time.
DepthRange range_of(const Scene& scene, int view, const std::function<double()>& median_of) {
  const View& v = scene.views[static_cast<size_t>(view)];
  if (v.near > 0 && v.far > v.near) return {v.near, v.far};
  const std::vector<double> depths = point_depths(scene, v.camera);
  constexpr size_t kEnoughPoints = 20;
  if (depths.size() >= kEnoughPoints) {
    // Sparse points miss what has no texture: leave room before and behind them.
    return {0.8 * nearest_rank(depths, kOrderQuantile),
            1.5 * nearest_rank(depths, 1 - kOrderQuantile)};
  }
  const double baseline = median_of();
  if (!(baseline > 0)) {
    throw BadInput(Defect::Value,
                   scene.folder,
                   "the input cameras share one centre (baseline 0), so no depth can be measured; "
                   "choose views taken from different places");
  }
  const Eigen::Vector3d uvz = project_offset(v.camera, convergence_from(v.camera.center(), scene));
  // Axes that (nearly) meet in front of the camera say where the subject is; parallel axes leave
  // only the baseline as a unit of length.
  if (std::isfinite(uvz.z()) && uvz.z() > baseline * 0.5 && uvz.z() < baseline * 100) {
    return {0.3 * uvz.z(), 4.0 * uvz.z()};
  }
  return {2 * baseline, 100 * baseline};
}

}  // namespace

std::string scene_kind_name(SceneKind kind) {
  return kSceneKinds.at(static_cast<size_t>(kind)).second;
}

SceneKind scene_kind_of(std::string_view name) {
  const auto* const found = std::find_if(
      kSceneKinds.begin(), kSceneKinds.end(), [&](const auto& row) { return row.second == name; });
  return found == kSceneKinds.end() ? SceneKind::Unknown : found->first;
}

double median_baseline(const Scene& scene) {
  // Of thousands of frames, some of them tell it: all pairs would take gigabytes.
  constexpr size_t kMost = 1000;
  const size_t step = 1 + (scene.input.size() - 1) / kMost;
  std::vector<double> lengths;
  for (size_t i = 0; i < scene.input.size(); i += step) {
    for (size_t j = i + step; j < scene.input.size(); j += step) {
      const auto& a = scene.views[static_cast<size_t>(scene.input[i])].camera;
      const auto& b = scene.views[static_cast<size_t>(scene.input[j])].camera;
      lengths.push_back((a.center() - b.center()).norm());
    }
  }
  return lengths.empty() ? 0 : nearest_rank(lengths, 0.5);
}

DepthRange depth_range(const Scene& scene, int view) {
  return range_of(scene, view, [&] { return median_baseline(scene); });
}

std::vector<DepthRange> depth_ranges(const Scene& scene) {
  std::optional<double> baseline;
  const auto median_of = [&] {
    if (!baseline) baseline = median_baseline(scene);
    return *baseline;
  };
  std::vector<DepthRange> out;
  for (const int i : scene.input) out.push_back(range_of(scene, i, median_of));
  return out;
}

std::vector<Eigen::Vector3d> subject_points(const Scene& scene) {
  std::vector<Eigen::Vector3d> points;
  const std::vector<DepthRange> ranges = depth_ranges(scene);
  for (size_t k = 0; k < scene.input.size(); ++k) {
    const Camera& camera = scene.views[static_cast<size_t>(scene.input[k])].camera;
    points.push_back(camera.center());
    const DepthRange& range = ranges[k];
    // The far bound may be guessed generously; the near half of the range in inverse depth is
    // where the subject stands.
    const double middle = 2 / (1 / range.near + 1 / range.far);
    points.push_back(camera.unproject(camera.cx, camera.cy, middle));
  }
  return points;
}

void to_canonical(Scene& scene) {
  const Frame canonical = canonical_frame(subject_points(scene));
  scene.frame.origin = canonical.origin;
  scene.frame.scale = canonical.scale;
  scene.frame.file_origin = canonical.file_origin;
  for (View& view : scene.views) {
    view.camera.world_from_cam = internal_from_world(scene.frame, view.camera.world_from_cam);
    view.near /= scene.frame.scale;
    view.far /= scene.frame.scale;
  }
  for (SparsePoint& point : scene.points) {
    point.position = scene.frame.internal_from_world(point.position);
  }
}

}  // namespace cgs
