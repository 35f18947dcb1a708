// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "libcgs/poses/solve_poses.h"
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

/// Largest differences between solved and given cameras, after the rotation that brings them
/// together best.
struct PoseErrors {
  double axes = 0;  ///< Of the cameras' axes [degrees].
  /// Of what the pixels look at [degrees]: a principal point off the centre, which few photographs
  /// do not tell, turns the axes but hardly the rays.
  double rotation = 0;
  double direction = 0;  ///< Between any two cameras [degrees].
  double focal = 0;      ///< Relative.
};

/// The rotation nearest to a matrix.
inline Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& H) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// What turns a camera's axes such that its pixels look where those of another lens do.
inline Eigen::Matrix3d between_rays(const Camera& from, const Camera& to) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (const double u : {0.1, 0.5, 0.9}) {
    for (const double v : {0.1, 0.5, 0.9}) {
      H += to.ray_in_cam(u * to.width, v * to.height).normalized() *
           from.ray_in_cam(u * from.width, v * from.height).normalized().transpose();
    }
  }
  return nearest_rotation(H);
}

/// Largest angle [degrees] between rotations, after the one that brings all together best, which it
/// returns.
inline Eigen::Matrix3d largest_turn(const std::vector<Eigen::Matrix3d>& solved,
                                    const std::vector<Eigen::Matrix3d>& given,
                                    double& degrees) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < solved.size(); ++i) H += given[i] * solved[i].transpose();
  const Eigen::Matrix3d align = nearest_rotation(H);
  degrees = 0;
  for (size_t i = 0; i < solved.size(); ++i) {
    const Eigen::AngleAxisd off(Eigen::Matrix3d(given[i].transpose() * align * solved[i]));
    degrees = std::max(degrees, off.angle() * 180 / M_PI);
  }
  return align;
}

inline PoseErrors pose_errors(const std::vector<Camera>& solved, const std::vector<Camera>& given) {
  std::vector<Eigen::Matrix3d> axes;
  std::vector<Eigen::Matrix3d> rays;
  std::vector<Eigen::Matrix3d> truth;
  PoseErrors errors;
  for (size_t i = 0; i < solved.size(); ++i) {
    axes.push_back(solved[i].world_from_cam.rotation());
    rays.push_back(axes.back() * between_rays(solved[i], given[i]).transpose());
    truth.push_back(given[i].world_from_cam.rotation());
    errors.focal = std::max(errors.focal, std::abs(solved[i].fx / given[i].fx - 1));
  }
  (void)largest_turn(axes, truth, errors.axes);
  const Eigen::Matrix3d align = largest_turn(rays, truth, errors.rotation);
  for (size_t i = 0; i < solved.size(); ++i) {
    for (size_t j = i + 1; j < solved.size(); ++j) {
      const Eigen::Vector3d u = given[j].center() - given[i].center();
      const Eigen::Vector3d v = align * (solved[j].center() - solved[i].center());
      const double off = std::atan2(u.cross(v).norm(), u.dot(v));
      errors.direction = std::max(errors.direction, off * 180 / M_PI);
    }
  }
  return errors;
}

}  // namespace cgs::test
