// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/measurable_mesh.h"

namespace cgs {

/// A point on a mesh.
struct SurfacePoint {
  uint32_t face = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [internal units]
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();   ///< Barycentric; >= 0, their sum is 1.
};

/// What a mesh states at a point on it.
struct SurfaceEvidence {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< Of the face; unit length.
  double sigma = 0;                                  ///< [internal units]; NaN = no statement.
  Provenance provenance = Provenance::Inferred;      ///< Inferred if the mesh states none.
};

SurfaceEvidence evidence_at(const MeasurableMesh& mesh, const SurfacePoint& point);

/// Answers where a mesh is nearest to points, and on which side of it they lie. Queries may run in
/// parallel.
class NearestSurface {
 public:
  /// \throws InvalidInput if no face has an area
  explicit NearestSurface(const MeasurableMesh& mesh);
  ~NearestSurface();
  NearestSurface(const NearestSurface&) = delete;
  NearestSurface& operator=(const NearestSurface&) = delete;

  SurfacePoint nearest(const Eigen::Vector3d& point) const;
  /// The same where it is nearer than `distance`; faster than nearest() where nothing is.
  std::optional<SurfacePoint> nearest_within(const Eigen::Vector3d& point, double distance) const;

  /// Distance to the nearest point, positive on the side that faces look to.
  ///
  /// Where an edge or a vertex is nearest, its pseudonormal decides (Baerentzen and Aanaes 2005,
  /// "Signed distance computation using the angle weighted pseudonormal").
  double signed_distance(const Eigen::Vector3d& point, const SurfacePoint& nearest) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace cgs
