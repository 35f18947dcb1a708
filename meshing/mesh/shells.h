// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/measurable_mesh.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/components.h"

namespace cgs {

class NearestSurface;

/// Tells which shells of a mesh lie within which. Mesh and parts must outlive it.
/// \pre every shell is closed, neighbours agree on the winding
class ShellNesting {
 public:
  ShellNesting(const TriangleMesh& mesh, const MeshComponents& parts);

  /// Those of `shells`, ascending, on the inner side of `outer`, whichever way that one looks.
  /// Costs no more than boxes where none lies in the box of `outer`. Shells that cut it are on the
  /// side of the first vertex off its surface; those that lie on it are not within.
  std::vector<uint32_t> within(uint32_t outer, const std::vector<uint32_t>& shells) const;

 private:
  MeasurableMesh alone(uint32_t shell) const;
  std::vector<uint32_t> in_box_of(uint32_t outer, const std::vector<uint32_t>& shells) const;
  bool is_within(uint32_t shell, const NearestSurface& outer, bool inside_out) const;

  const TriangleMesh& mesh_;
  const MeshComponents& parts_;
  std::vector<std::vector<uint32_t>> faces_;  // per shell
  std::vector<Eigen::AlignedBox3f> boxes_;    // per shell
  std::vector<uint32_t> by_low_x_;            // shells, by where their boxes begin
};

/// A mesh whose shells bound one solid.
struct SettledShells {
  TriangleMesh mesh;
  size_t turned = 0;   ///< Shells that look the other way now.
  size_t dropped = 0;  ///< Shells with matter on both sides, as of a doubled surface.
};

/// Makes the shells of a mesh bound one solid.
///
/// Outermost shells come to look outwards; where one has to be turned, all within it turn with it.
/// A shell within another stays where matter ends or begins there, as around a cavity, and goes
/// where there is matter, or none, on both sides.
/// \pre closed, manifold, neighbours agree on the winding, faces do not cut each other
SettledShells settled_shells(const TriangleMesh& mesh);

}  // namespace cgs
