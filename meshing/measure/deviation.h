// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/nearest_surface.h"

namespace cgs {

/// Whether a place of A differs from B by more than the sigmas that both state explain.
enum class Change : uint8_t {
  Unknown = 0,  ///< One side was not observed or states no sigma there, or B ends before it gets
                ///< there: nothing can be said.
  None = 1,     ///< Within 2 standard deviations.
  Nearer = 2,   ///< Beyond them, A lies on the inner side of B: material is missing in A.
  Farther = 3,  ///< Beyond them, A lies on the outer side of B: material was added in A.
};

/// A point of A held against the surface B.
struct Deviation {
  double distance = 0;  ///< To the nearest point of B, positive on the outer side [internal units].
  double sigma = 0;     ///< Of that distance, from both sides; NaN = no statement.
  Change change = Change::Unknown;
  bool is_beyond_rim = false;  ///< B ends before it gets there: the distance is that to its rim.
};

/// The points to compare: places on A's faces by area, or the points of a cloud.
struct ComparedPoints {
  std::vector<Eigen::Vector3d> places;  ///< [internal units]
  std::vector<double> sigma;            ///< NaN = no statement.
  std::vector<uint8_t> observed;        ///< 0 where provenance says that nobody saw it.
  /// Per place a direction to the outer side, 0 = not known there; empty = known nowhere. Only
  /// m3c2() asks for them.
  std::vector<Eigen::Vector3f> outward;
};

/// `count` places spread evenly over the area of the mesh; all points of a cloud.
ComparedPoints points_by_area(const MeasurableMesh& mesh, size_t count);
/// The vertices, in their order.
ComparedPoints points_by_vertex(const MeasurableMesh& mesh);

/// Adds to sigma how far an error of the scale moves places away from `center`, where it moves
/// none.
/// \param relative  standard deviation of the scale as a share of it
void add_scale_sigma(ComparedPoints& points, double relative, const Eigen::Vector3d& center);

/// Signed distances of points to a surface, and whether they are more than uncertainty.
///
/// |d| > 2 sqrt(sigma_a^2 + sigma_b^2) counts as changed, where both sides were observed (by one
/// view at least) and state a sigma: invented or estimated surface never counts, nor do places
/// beyond the rim of an open B, which says nothing of them. Both in the same frame.
std::vector<Deviation> deviations(const ComparedPoints& points,
                                  const MeasurableMesh& mesh_b,
                                  const NearestSurface& surface_b);

/// Figures of signed distances [internal units].
struct DeviationSummary {
  size_t count = 0;
  double mean = 0;
  double standard_deviation = 0;
  double rms = 0;
  double mean_absolute = 0;
  double median = 0;
  double p05 = 0;  ///< 5 % lie below, as signed numbers.
  double p95 = 0;
  double p95_absolute = 0;
  double max_absolute = 0;
};

DeviationSummary summarize(const std::vector<Deviation>& deviations);

/// Counts of distances in `bins` equal bins over [low, high]; values beyond go to the ends.
std::vector<size_t> histogram(const std::vector<Deviation>& deviations,
                              double low,
                              double high,
                              int bins);

}  // namespace cgs
