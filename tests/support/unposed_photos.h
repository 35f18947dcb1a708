// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "libcgs/priors/solve_poses.h"
#include "tests/support/stereo_scene.h"

namespace cgs::test {

/// What photographs of scattered points would yield, with everything known.
struct PointScene {
  std::vector<Camera> cameras;
  std::vector<Eigen::Vector3d> points;
  double noise = 0.3;   ///< Of each coordinate of a feature [pixels].
  double outliers = 0;  ///< Share of features that look like a point they do not show.
  double k1 = 0;        ///< Distortion of the lens.
  unsigned seed = 1;
};

/// Points in a box around the origin.
inline std::vector<Eigen::Vector3d> scattered_points(int count, const Eigen::Vector3d& half) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Eigen::Vector3d> out;
  for (int i = 0; i < count; ++i) {
    const double x = uniform(random);
    const double y = uniform(random);
    const double z = uniform(random);
    out.push_back(half.cwiseProduct(Eigen::Vector3d(x, y, z)));
  }
  return out;
}

/// Features of one camera, in another order in every photograph; the descriptor of a point is the
/// same noise everywhere, slightly disturbed.
inline UnposedPhoto unposed_photo(const PointScene& scene, size_t camera_index) {
  const Camera& camera = scene.cameras[camera_index];
  std::mt19937 random(scene.seed * 1000 + static_cast<unsigned>(camera_index));
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  UnposedPhoto photo;
  photo.name = "photo_" + std::to_string(camera_index);
  photo.width = camera.width;
  photo.height = camera.height;
  std::vector<Eigen::RowVectorXf> descriptors;
  const size_t count = scene.points.size();
  for (size_t k = 0; k < count; ++k) {
    const size_t i = (k * 7919 + camera_index * 31) % count;
    const Eigen::Vector3d p = camera.cam_from_world() * scene.points[i];
    if (p.z() <= 0) continue;
    const Eigen::Vector2d direction = p.hnormalized();
    const Eigen::Vector2d distorted = direction * (1 + scene.k1 * direction.squaredNorm());
    Eigen::Vector2d at(camera.fx * distorted.x() + camera.cx,
                       camera.fy * distorted.y() + camera.cy);
    at += scene.noise * Eigen::Vector2d(normal(random), normal(random));
    if (uniform(random) < scene.outliers) {
      at = {uniform(random) * camera.width, uniform(random) * camera.height};
    }
    if (!camera.sees({at.x(), at.y(), 1})) continue;
    std::mt19937 look(static_cast<unsigned>(i) + 12345);
    Eigen::RowVectorXf descriptor(32);
    for (float& x : descriptor) x = static_cast<float>(normal(look));
    for (float& x : descriptor) x += 0.1f * static_cast<float>(normal(random));
    photo.features.points.push_back(at);
    descriptors.push_back(descriptor.normalized());
  }
  photo.features.descriptors.resize(static_cast<Eigen::Index>(descriptors.size()), 32);
  for (size_t i = 0; i < descriptors.size(); ++i) {
    photo.features.descriptors.row(static_cast<Eigen::Index>(i)) = descriptors[i];
  }
  return photo;
}

inline std::vector<UnposedPhoto> unposed_photos(const PointScene& scene) {
  std::vector<UnposedPhoto> out;
  for (size_t i = 0; i < scene.cameras.size(); ++i) out.push_back(unposed_photo(scene, i));
  return out;
}

/// Largest differences between solved and given cameras, after the rotation that brings their axes
/// together best.
struct PoseErrors {
  double rotation = 0;   ///< [degrees]
  double direction = 0;  ///< Between any two cameras [degrees].
  double focal = 0;      ///< Relative.
};

inline PoseErrors pose_errors(const std::vector<Camera>& solved, const std::vector<Camera>& given) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < solved.size(); ++i) {
    H += given[i].world_from_cam.rotation() * solved[i].world_from_cam.rotation().transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  const Eigen::Matrix3d align = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  const auto degrees = [](double radians) { return radians * 180 / M_PI; };
  PoseErrors errors;
  for (size_t i = 0; i < solved.size(); ++i) {
    const Eigen::Matrix3d off = given[i].world_from_cam.rotation().transpose() * align *
                                solved[i].world_from_cam.rotation();
    errors.rotation = std::max(errors.rotation, degrees(Eigen::AngleAxisd(off).angle()));
    errors.focal = std::max(errors.focal, std::abs(solved[i].fx / given[i].fx - 1));
    for (size_t j = i + 1; j < solved.size(); ++j) {
      const Eigen::Vector3d u = given[j].center() - given[i].center();
      const Eigen::Vector3d v = align * (solved[j].center() - solved[i].center());
      errors.direction =
          std::max(errors.direction, degrees(std::atan2(u.cross(v).norm(), u.dot(v))));
    }
  }
  return errors;
}

}  // namespace cgs::test
