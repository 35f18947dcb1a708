// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "meshing/measure/deviation.h"

namespace cgs {

/// Scales of a comparison of two clouds along local normals; all lengths in internal units.
struct M3c2Options {
  double normal_scale = 0;  ///< Diameter of the ball whose points of A give the normal; > 0.
  double cylinder = 0;  ///< Diameter of the cylinder along the normal whose points of A and of B
                        ///< are averaged; > 0.
  double depth = 0;     ///< How far the cylinder reaches to either side; > 0.
  double registration = 0;  ///< Standard deviation of the registration of A to B; >= 0.
  double scale_sigma = 0;   ///< That of one scale against the other, as a share of it; >= 0.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< Where an error of scale moves nothing.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// What the two clouds say at a place.
struct M3c2Place {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< Unit length; 0 = too few points around.
  double distance = 0;     ///< From B to A along the normal: of the means; NaN = cannot be told.
  double detection = 0;    ///< Level of detection at 95 %, as distance; NaN = cannot be told.
  double roughness_a = 0;  ///< Standard deviation of A's points in the cylinder along the normal.
  double roughness_b = 0;
  uint32_t count_a = 0;  ///< Points in the cylinder.
  uint32_t count_b = 0;
  uint32_t stated_a = 0;  ///< Those of them that state a sigma.
  uint32_t stated_b = 0;
  bool is_split = false;  ///< Points of one side leave a gap along the normal that is wider than
                          ///< the cylinder: means of two surfaces, likely.
  Change change = Change::Unknown;  ///< Unknown where detection is NaN.
};

/// Diameter of a cylinder that holds about 30 points of the sparser of two clouds where these are
/// spread over a surface.
/// \throws InvalidInput without seen points in different places
double spacing_cylinder(const ComparedPoints& a, const ComparedPoints& b);

/// The scales that go with a cylinder: twice its diameter for normals, ten times for the depth.
M3c2Options m3c2_scales(double cylinder);

/// Distances of A from B at `places`, with what roughness and known errors allow to detect.
///
/// Detection is 1.96 (sqrt(v_a + v_b + s^2) + registration), s being how far an error of the scale
/// moves the place along the normal. v is the variance of a mean: roughness^2 / n
/// of the n points of that side, where these do not state what they are worth (Lague et al.); the
/// mean of their sigma^2, where all do: errors of neighbours in one reconstruction are alike, and
/// do not average out (James et al.); the larger of the two, where some do: what others do not
/// state must not make the mean better. Points that nobody saw are left out. At least four points
/// of either side are needed.
///
/// Where both clouds say what is outside, points that look against the normal are left out: those
/// of the other wall of what is thinner than the cylinder is deep. Else its mean is one of both
/// walls, and a wall that moved alone seems to have moved by less.
/// \param outward  per place a direction on whose side the normal is to lie; 0 = as it comes
/// Source: Lague, Brodu and Leroux 2013, "Accurate 3D comparison of complex topography with
/// terrestrial laser scanner"; James, Robson and Smith 2017, "3-D uncertainty-based topographic
/// change detection with structure-from-motion photogrammetry" (M3C2-PM).
std::vector<M3c2Place> m3c2(const std::vector<Eigen::Vector3d>& places,
                            const std::vector<Eigen::Vector3f>& outward,
                            const ComparedPoints& a,
                            const ComparedPoints& b,
                            const M3c2Options& options);

}  // namespace cgs
