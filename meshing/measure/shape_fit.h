// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/measured_value.h"

namespace cgs {

enum class Shape { Plane, Sphere, Cylinder };

/// A shape laid through a patch of surface by least squares of the distances, weighted by area.
///
/// A plane lies through the surface. Sphere and cylinder lie through the corners of its faces,
/// which are on a round shape where the facets between them are not; repeated vertices count once.
///
/// Standard deviations have two parts: residuals, as if every vertex erred on its own, and the
/// sigma that the vertices state, as if they all erred the same way. Where none states one, the
/// first part is all there is, and the radius has no sigma.
struct ShapeFit {
  Shape shape = Shape::Plane;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< Of the plane or the axis, nearest to the
                                                    ///< middle of the patch; centre of the sphere.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit; normal of the plane, outwards, or
                                                        ///< axis of the cylinder.
  MeasuredValue radius;                                 ///< Of sphere and cylinder.
  double radius_scatter = 0;   ///< Standard deviation of the radius by residuals alone.
  double point_sigma = 0;      ///< Of the plane along its normal; of centre and axis, any way.
  double direction_sigma = 0;  ///< [radians]
  double rms = 0;  ///< Of the distances of all surface to the shape [internal units], so with what
                   ///< facets cut off.
  double largest = 0;
  MeasuredValue area;   ///< Of the patch.
  size_t vertices = 0;  ///< Different positions of them, of the faces that the patch has a part of.
};

/// Fits a shape to the part of the surface within a ball.
///
/// \throws InvalidInput if the ball holds too little surface; NumericalError if the patch does not
///         determine the shape (a sphere on a flat wall)
ShapeFit fit_shape(const MeasurableMesh& mesh,
                   Shape shape,
                   const Eigen::Vector3d& center,
                   double radius);

}  // namespace cgs
