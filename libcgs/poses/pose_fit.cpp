// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/pose_fit.h"

#include <cmath>

#include "libcgs/core/angle_between.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/poses/photo_pairs.h"

namespace cgs {

namespace {

Eigen::Vector3d ray(const Eigen::Vector2d& at, double focal) {
  return {at.x() / focal, at.y() / focal, 1};
}

// Distance of a point from the line that a normal stands for [units of the focal length]; not
// finite where a ray along the baseline leaves no line.
double distance(const Eigen::Vector3d& line, const Eigen::Vector3d& at) {
  return std::abs(line.dot(at)) / line.head<2>().norm();
}

// Mean of the distances in both photographs [working pixels], per match that has any.
std::vector<double> epipolar_errors(const PosedPhoto& a,
                                    const PosedPhoto& b,
                                    const MatchedPoints& points) {
  const Eigen::Matrix3d b_from_a =
      b.camera.world_from_cam.linear().transpose() * a.camera.world_from_cam.linear();
  // Subtracted before it is turned: coordinates may be large.
  const Eigen::Vector3d baseline = a.camera.center() - b.camera.center();
  const Eigen::Vector3d shift =
      b.camera.world_from_cam.linear().transpose() * baseline.stableNormalized();
  Eigen::Matrix3d cross;
  cross << 0, -shift.z(), shift.y(), shift.z(), 0, -shift.x(), -shift.y(), shift.x(), 0;
  const Eigen::Matrix3d E = cross * b_from_a;
  const double focal_a = working_focal(a);
  const double focal_b = working_focal(b);
  std::vector<double> out;
  for (size_t i = 0; i < points.a.size(); ++i) {
    const Eigen::Vector3d in_a = ray(points.a[i], focal_a);
    const Eigen::Vector3d in_b = ray(points.b[i], focal_b);
    if (baseline.isZero(0)) {
      out.push_back(0.5 * (focal_a + focal_b) * angle_between(b_from_a * in_a, in_b));
      continue;
    }
    const double off_a = focal_a * distance(E.transpose() * in_b, in_a);
    const double off_b = focal_b * distance(E * in_a, in_b);
    const double off = 0.5 * (off_a + off_b);
    if (std::isfinite(off)) out.push_back(off);
  }
  return out;
}

}  // namespace

double working_focal(const PosedPhoto& photo) {
  return std::sqrt(photo.camera.fx * photo.camera.fy) / photo.features.pixel;
}

UnposedPhoto as_unposed(const PosedPhoto& photo) {
  UnposedPhoto out;
  out.name = photo.name;
  out.features = photo.features;
  const double focal = std::sqrt(photo.camera.fx * photo.camera.fy);
  for (Eigen::Vector2d& at : out.features.points) {
    at = focal * photo.camera.ray_in_cam(at.x(), at.y()).head<2>();
  }
  return out;
}

std::vector<EpipolarFit> epipolar_fits(const std::vector<PosedPhoto>& photos,
                                       const Progress& progress) {
  std::vector<UnposedPhoto> unposed;
  unposed.reserve(photos.size());
  for (const PosedPhoto& photo : photos) unposed.push_back(as_unposed(photo));
  std::vector<EpipolarFit> out;
  for (const PhotoPair& pair : match_photos(unposed, progress)) {
    if (!pair.is_connected) continue;
    const std::vector<double> errors = epipolar_errors(
        photos[static_cast<size_t>(pair.a)], photos[static_cast<size_t>(pair.b)], pair.points);
    if (errors.empty()) continue;
    out.push_back({pair.a, pair.b, errors.size(), median_of(errors)});
  }
  return out;
}

}  // namespace cgs
