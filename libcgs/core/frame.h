// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace cgs {

/// How the length of one scene unit became known.
enum class ScaleSource { Unknown, Assumed, CameraPoses, KnownDistance, ControlPoints, DepthSensor };

std::string scale_source_name(ScaleSource source);

/// Relative standard deviation of scales from tracked poses, for which phones and programs state
/// none.
inline constexpr double kTrackedScale = 0.05 / 3;

/// The canonical frame all float data live in, and how to leave it.
///
/// world = origin + scale * internal. The origin is snapped to a power-of-two grid and the scale is
/// a power of two, so that multiplying the world by 2^k, or moving it by a multiple of the grid,
/// leaves every internal number bit-identical. Files hold world coordinates minus `file_origin`,
/// which is zero unless the scene lies so far away that float coordinates would lose it.
struct Frame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();       ///< World point of internal (0, 0, 0).
  double scale = 1.0;                                     ///< World units per internal unit; 2^k.
  Eigen::Vector3d file_origin = Eigen::Vector3d::Zero();  ///< World point of (0, 0, 0) in files.
  double metres_per_unit = 0;                             ///< Metres per world unit; 0 = unknown.
  double metres_sigma = 0;  ///< Standard deviation of metres_per_unit; 0 = not estimated.
  ScaleSource scale_source = ScaleSource::Unknown;
  Eigen::Vector3d up =
      Eigen::Vector3d::Zero();  ///< World direction, unit length; zero = not known.

  /// \throws InvalidInput naming the first field that no scene can have.
  void validate() const;

  bool has_metric_scale() const { return metres_per_unit > 0; }
  bool knows_up() const { return !up.isZero(0); }
  /// "m", "mm", … for a known metres_per_unit of that name, "<x> m" for others, "unknown".
  std::string unit_name() const;

  Eigen::Vector3d world_from_internal(const Eigen::Vector3d& p) const;
  Eigen::Vector3d internal_from_world(const Eigen::Vector3d& p) const;
  Eigen::Vector3d file_from_internal(const Eigen::Vector3d& p) const;
  Eigen::Vector3d internal_from_file(const Eigen::Vector3d& p) const;
};

/// A frame for a scene whose cameras and roughly whose surface lie at `points_in_world`.
///
/// The internal extent (largest side of the bounding box) comes to lie in [0.5, 1).
/// \throws InvalidInput if there is no point, or one is not finite.
Frame canonical_frame(const std::vector<Eigen::Vector3d>& points_in_world);

/// Where the zero of files with the content of `frame` lies: at `wanted`, unless float coordinates
/// from there would keep fewer than 16 bits of the content, then at the origin of the frame.
Eigen::Vector3d file_origin_near(const Frame& frame, const Eigen::Vector3d& wanted);

/// The same frame of a world whose unit is the metre.
/// \pre frame.has_metric_scale()
Frame in_metres(Frame frame);

/// How many binary digits of the coordinates in a box tell its points apart: log2 of its largest
/// side over the spacing of numbers where the box is farthest from zero.
///
/// \param digits  of a coordinate as it was stored: 53 = double, 24 = float
/// \return -infinity for a box without extent; at most `digits`
double significant_bits(const Eigen::AlignedBox3d& box, int digits);

/// The same pose with its translation moved into (or out of) the canonical frame; axes stay.
Eigen::Isometry3d internal_from_world(const Frame& frame, const Eigen::Isometry3d& world_from_cam);
Eigen::Isometry3d world_from_internal(const Frame& frame,
                                      const Eigen::Isometry3d& internal_from_cam);

}  // namespace cgs
