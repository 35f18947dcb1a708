// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

#include "libcgs/core/frame.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A mesh, or a point cloud if it has no faces, on its way through a chain of operations.
struct FilterState {
  TriangleMesh mesh;
  Frame frame;
  Eigen::Vector3d file_origin = Eigen::Vector3d::Zero();  ///< World point of (0, 0, 0) of the file
                                                          ///< read, in which arguments are given.

  Eigen::Vector3d internal_from_file(const Eigen::Vector3d& p) const {
    return (p - (frame.origin - file_origin)) / frame.scale;
  }
  Eigen::Vector3d file_from_internal(const Eigen::Vector3d& p) const {
    return (frame.origin - file_origin) + frame.scale * p;
  }
  bool is_cloud() const { return mesh.faces.empty(); }
};

/// One operation with its arguments: changes the state and returns a remark for the user ("12
/// holes", may be empty). Throws what libcgs/core/error.h lists.
using FilterStep = std::function<std::string(FilterState& state, const Progress& progress)>;

}  // namespace cgs
