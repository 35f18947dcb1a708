// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A mesh to take measurements of, or a point cloud if it has no faces.
///
/// What its file does not state stays unknown: without `mesh.provenance` nobody said what was
/// observed, without `mesh.sigma` nobody said how well.
struct MeasurableMesh {
  TriangleMesh mesh;                    ///< Faces and evidence; its vertices are `points` as float.
  std::vector<Eigen::Vector3d> points;  ///< [internal units], with all digits of the file.
  Frame frame;
  Eigen::Vector3d file_origin = Eigen::Vector3d::Zero();  ///< World point of (0, 0, 0) of the file
                                                          ///< read; files written use that of
                                                          ///< `frame`.

  Eigen::Vector3d internal_from_file(const Eigen::Vector3d& p) const {
    return (p - (frame.origin - file_origin)) / frame.scale;
  }
  Eigen::Vector3d file_from_internal(const Eigen::Vector3d& p) const {
    return (frame.origin - file_origin) + frame.scale * p;
  }
  bool states_provenance() const { return !mesh.provenance.empty(); }
  /// Whether any vertex has a sigma: files without one may still have the attribute. It looks
  /// through all of them; of one place its sigma tells, which is NaN there.
  bool states_sigma() const {
    return std::any_of(
        mesh.sigma.begin(), mesh.sigma.end(), [](float s) { return std::isfinite(s); });
  }
};

}  // namespace cgs
