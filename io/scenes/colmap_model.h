// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/fisheye.h"

namespace cgs {

/// A camera of a COLMAP model; the pose of `camera` is not set.
struct ColmapCamera {
  Camera camera;
  std::array<double, 5> distortion = {};  ///< k1 k2 p1 p2 k3
  std::optional<Fisheye> fisheye;  ///< Of fisheye models; `camera` is that of the photograph.
};

struct ColmapImage {
  uint32_t id = 0;
  uint32_t camera_id = 0;
  std::string name;                                       ///< Path below the image folder.
  Eigen::Vector4d rotation = Eigen::Vector4d::UnitX();    ///< cam_from_world, (w, x, y, z)
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< cam_from_world
  uint64_t keypoints = 0;                                 ///< Number of 2D points.
  std::vector<Eigen::Vector2d> points;  ///< Their places, for writing; readers leave them out.
};

struct ColmapPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< May be not finite: check.
  std::vector<std::pair<uint32_t, uint32_t>> track;    ///< (image id, keypoint index)
  std::array<int, 3> color = {};  ///< 0 ... 255, for writing; readers leave it out.
  double error = 0;               ///< Mean reprojection error [pixels], likewise.
};

using ColmapCameras = std::map<uint32_t, ColmapCamera>;

struct ColmapModel {
  ColmapCameras cameras;
  std::vector<ColmapImage> images;
  std::vector<ColmapPoint> points;
};

/// Readers of COLMAP's model files. Camera models SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL,
/// OPENCV, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE and OPENCV_FISHEYE are understood.
/// \throws BadInput Truncated, Count, Syntax (also ids that occur twice), Unsupported (other camera
///         models), Value (intrinsics out of range, naming the camera); LimitError.
/// Source: COLMAP documentation, "Output format"; binary layout of COLMAP 3.x.
///
/// \param used  ids of the cameras that images name: others are left out, and neither their model
///              nor their parameters are judged; null: all are read
ColmapCameras read_colmap_cameras_binary(const std::filesystem::path& path,
                                         const std::set<uint32_t>* used = nullptr);
ColmapCameras read_colmap_cameras_text(const std::filesystem::path& path,
                                       const std::set<uint32_t>* used = nullptr);
std::vector<ColmapImage> read_colmap_images_binary(const std::filesystem::path& path);
std::vector<ColmapImage> read_colmap_images_text(const std::filesystem::path& path);
std::vector<ColmapPoint> read_colmap_points_binary(const std::filesystem::path& path);
/// A text file without any byte counts as no points: models from known poses start like that.
std::vector<ColmapPoint> read_colmap_points_text(const std::filesystem::path& path);

}  // namespace cgs
