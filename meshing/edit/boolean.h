// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/certificate.h"

namespace cgs {

enum class BooleanOperation { Union, Intersection, Difference };

/// The surface of what two solids have together.
struct BooleanResult {
  TriangleMesh mesh;              ///< No faces if nothing is left.
  size_t from_second = 0;         ///< Faces that come from the second mesh.
  size_t self_intersections = 0;  ///< Pairs of faces, from rounding to float coordinates.
};

/// Why a mesh bounds no volume: "is not closed", …; empty if it does.
std::string why_no_solid(const TriangleMesh& mesh);

/// The same as far as a certificate tells: nothing about shells within shells.
std::string why_no_solid(const Certificate& certificate);

/// The union, intersection, or difference (first less second) of two solids in the same frame.
///
/// Which parts lie inside is decided exactly; new vertices, where faces cut each other, are rounded
/// to float. Every face keeps the label of the face it is a part of; of a subtracted solid too,
/// whose faces then look the other way. Vertices state what that face does there, those on the cut
/// the lesser of both: the larger sigma, the smaller support. What only one mesh states is filled
/// in for the other as by joined(). Normals, if any, are made anew from the faces.
/// Source: CGAL, Polygon Mesh Processing, corefinement.
/// \pre why_no_solid() of both is empty
/// \throws NumericalError if the result would not be manifold
BooleanResult boolean(const TriangleMesh& first,
                      const TriangleMesh& second,
                      BooleanOperation operation);

}  // namespace cgs
