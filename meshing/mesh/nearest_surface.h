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

/// Whether the surface ends somewhere: it has an edge of one face alone, faces meeting where their
/// corners are in the same places.
bool has_rim(const MeasurableMesh& mesh);

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
  /// "Signed distance computation using the angle weighted pseudonormal"): that of all faces there,
  /// whether they share vertices or have their own in the same place.
  double signed_distance(const Eigen::Vector3d& point, const SurfacePoint& nearest) const;

  /// Whether the nearest place is on the rim of the surface: on an edge of one face alone, or at
  /// an end of such an edge. Faces meet where their corners are in the same places.
  bool is_on_rim(const SurfacePoint& nearest) const;
  /// Whether the surface ends before it reaches the point: the nearest place is on the rim, and the
  /// point lies farther out than the face there, not just above or below it, by more than a
  /// millionth of its distance and than coordinates rounded to float can be off.
  bool is_beyond_rim(const Eigen::Vector3d& point, const SurfacePoint& nearest) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace cgs
