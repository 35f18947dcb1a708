// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/scene.h"

namespace cgs {

/// A photograph made ready for matching.
struct SweepImage {
  Raster<float> gray;  ///< Luma in [0, 255]; unusable pixels continue the usable ones smoothly.
  MaskMap valid;       ///< Of the full size; 1 where the photograph may be used.
};

SweepImage sweep_image(const View& view);

/// How the pixels of a reference view, on planes of constant z-depth, appear in another view.
///
/// Reference point (u, v) [pixels] on plane t lies at A (u, v, 1) + t b, homogeneous, in the
/// source; the third coordinate is source depth divided by reference depth.
struct SweepSource {
  int image = 0;           ///< Position in Scene::input.
  double speed = 0;        ///< Longest way of a seen pixel [pixels of the source per 1 / depth].
  bool is_matched = true;  ///< See matched_sources().
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();

  Eigen::Vector3d project(double u, double v, double t) const {
    return A * Eigen::Vector3d(u, v, 1) + t * b;
  }
  /// Way in the source when t grows by one [pixels], of a point in front of it.
  double parallax(double u, double v, double t) const {
    const Eigen::Vector3d h = project(u, v, t);
    return (b.head<2>() - h.head<2>() / h.z() * b.z()).norm() / h.z();
  }
};

/// The planes of one reference view: 1 / z = inverse_far + t * step for t = 0 … planes - 1.
///
/// A plane of the scene is affine in (u, v) under t, which is why all matching is done in t.
struct SweepGeometry {
  int image = 0;  ///< Position in Scene::input.
  double inverse_far = 0;
  double step = 0;  ///< > 0
  int planes = 0;
  std::vector<SweepSource> sources;  ///< The neighbours() that it is compared with.

  double inverse_depth(double t) const { return inverse_far + t * step; }
  double plane_of(double inverse_depth) const { return (inverse_depth - inverse_far) / step; }
};

/// The least and the largest value of an affine function of (u, v, 1) over a rectangle of pixels.
std::pair<double, double> range_over(const Eigen::RowVector3d& affine,
                                     const Eigen::Vector2d& from,
                                     const Eigen::Vector2d& to);

/// How densely the depth range is sampled.
struct SweepSampling {
  double pixels_per_plane = 1;  ///< Largest step between planes in any source [pixels].
  int max_planes = 256;
  double range_margin = 0.1;  ///< The range of inverse depth is widened by this fraction.
};

/// \throws BadInput(Value) if the cameras share one centre.
SweepGeometry sweep_geometry(const Scene& scene, int input, const SweepSampling& sampling);

/// How the pixels of a view, on its planes, appear in another; without image and speed.
SweepSource sweep_source(const Camera& reference,
                         const SweepGeometry& geometry,
                         const Camera& other);

/// The same with only those sources that the reference is matched with. Of up to four, that is all
/// that can tell planes apart: a photograph taken from almost the same place as the reference, as
/// in a burst, agrees with it on every plane and would outvote the others. Of more, it is the four
/// that together tell the most of what the reference shows: time then grows with the number of
/// photographs, not with its square.
SweepGeometry matched_sources(SweepGeometry geometry);

}  // namespace cgs
