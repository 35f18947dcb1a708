// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "libcgs/core/measurable_mesh.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Axes of a picture without perspective; unit length, right-handed, world axes.
struct PictureAxes {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  Eigen::Vector3d toward = Eigen::Vector3d::UnitZ();  ///< The viewer; heights count along it.
};

/// The sides of an object that stands upright.
enum class PictureSide { Top, Front, Back, Left, Right };

/// The axes of a side. Seen from the top the picture's right is world +X as far as `up` allows
/// (world +Y where up is within 26 degrees of it), so with +Z up the picture is a map; the viewer
/// of the front has that direction to his right, too.
/// \throws InvalidInput if `up` has no direction
PictureAxes picture_axes(PictureSide side, const Eigen::Vector3d& up);

/// The axes of the plane through three points, seen from where they run counter-clockwise; the
/// picture's right leads from the first to the second point.
/// \throws InvalidInput if the points lie on one line
PictureAxes picture_axes(const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c);

/// Where the pixels of a picture lie.
struct PictureGrid {
  PictureAxes axes;
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< Top left corner of the first pixel, along
                                                     ///< right and up [internal units].
  double pixel_size = 0;                             ///< [internal units]
  int width = 0;                                     ///< [pixels]
  int height = 0;                                    ///< [pixels]
};

/// A mesh as seen along one direction. Rasters are as large as the grid.
struct Orthophoto {
  ColorImage color;       ///< Vertex colours (grey without), not shaded; white outside.
  Raster<double> height;  ///< Of the surface nearest to the viewer, along axes.toward from internal
                          ///< (0, 0, 0) [internal units]; NaN outside.
  Raster<int8_t> label;   ///< The numbers of Provenance; -1 outside and without statement.
};

/// Both sides of a face are drawn; a pixel shows what lies at its centre. Heights are those of the
/// faces' planes, with no error beyond rounding. Same bits for any number of threads.
Orthophoto orthophoto(const MeasurableMesh& mesh, const PictureGrid& grid);

}  // namespace cgs
