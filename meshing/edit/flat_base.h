// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "libcgs/core/triangle_mesh.h"
#include "meshing/edit/boolean.h"

namespace cgs {

/// The mean direction that seen faces (observed or single view) look to; 0 where there are none, or
/// where they look to all sides alike. Not of unit length.
Eigen::Vector3d seen_side(const TriangleMesh& mesh);

/// A solid cut flat behind what was seen of it, such as a relief that is to stand on a plate.
struct FlatBase {
  BooleanResult solid;
  double cut_off = 0;  ///< Share of the volume.
};

/// Keeps of a solid what lies before a plane: the one across `front` that is `thickness` behind
/// the hindmost corner of a face that somebody saw; of any face where nothing is labelled. The cut
/// is labelled inferred.
///
/// \param front  direction towards those who look at it; any length but 0
/// \pre why_no_solid(mesh) is empty, thickness > 0
/// \throws NumericalError as boolean()
FlatBase with_flat_base(const TriangleMesh& mesh, const Eigen::Vector3d& front, double thickness);

}  // namespace cgs
