// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>

#include "libcgs/core/raster.h"

namespace cgs {

/// An undistorted pinhole camera.
///
/// Conventions of the whole project (COLMAP/OpenCV): camera axes +x right, +y down, +z forward;
/// pixel centres at +0.5, so the top-left corner of the image is (0, 0); depth is z-depth, not ray
/// length. Poses are double: scene coordinates may be large until Frame takes their origin away.
struct Camera {
  int width = 0;   ///< [pixels]
  int height = 0;  ///< [pixels]
  double fx = 0;   ///< [pixels]
  double fy = 0;   ///< [pixels]
  double cx = 0;   ///< [pixels], width / 2 for a centred principal point
  double cy = 0;   ///< [pixels]
  Eigen::Isometry3d world_from_cam = Eigen::Isometry3d::Identity();

  Eigen::Isometry3d cam_from_world() const;
  Eigen::Vector3d center() const { return world_from_cam.translation(); }
  /// The calibration matrix [pixels].
  Eigen::Matrix3d intrinsics() const;

  /// Direction in camera axes, with z = 1, of the ray through a point of the image [pixels].
  Eigen::Vector3d ray_in_cam(double u, double v) const {
    return {(u - cx) / fx, (v - cy) / fy, 1.0};
  }
  /// World point at z-depth `depth` on the ray through image point (u, v) [pixels].
  Eigen::Vector3d unproject(double u, double v, double depth) const {
    return world_from_cam * Eigen::Vector3d(depth * ray_in_cam(u, v));
  }
  /// (u, v, z) of a point given in camera axes; u and v are meaningless unless z > 0.
  Eigen::Vector3d project_in_cam(const Eigen::Vector3d& point_in_cam) const {
    const double z = point_in_cam.z();
    return {fx * point_in_cam.x() / z + cx, fy * point_in_cam.y() / z + cy, z};
  }
  /// (u, v, z) of a world point.
  Eigen::Vector3d project(const Eigen::Vector3d& point_in_world) const {
    return project_in_cam(cam_from_world() * point_in_world);
  }
  /// How wide a pixel is at a z-depth, in the unit of the depth.
  double pixel_size(double depth) const { return 2 * depth / (fx + fy); }
  bool sees(const Eigen::Vector3d& uvz) const {
    return uvz.z() > 0 && uvz.x() >= 0 && uvz.y() >= 0 && uvz.x() < width && uvz.y() < height;
  }
};

/// The camera of the same photograph at another size; the principal point keeps its place in the
/// picture (pixel centres at +0.5, so this is a plain scaling).
Camera resized(const Camera& camera, int width, int height);

/// The same at a size whose longer side is `side` pixels; one that is no larger stays as it is.
Camera resized_to_fit(const Camera& camera, int side);

/// Normals of a depth map by central differences of its unprojected points, one-sided at unknown
/// neighbours.
///
/// \return unit normals in world axes that face the camera; 0 where depth is unknown.
NormalMap normals_from_depth(const DepthMap& depth, const Camera& camera);

}  // namespace cgs
