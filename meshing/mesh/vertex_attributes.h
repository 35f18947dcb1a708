// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// How much of a vertex goes into a new one.
struct VertexShare {
  uint32_t vertex = 0;
  float weight = 0;  ///< In [0, 1]; the shares of a new vertex add up to 1.
};

/// Appends vertex `v` of a mesh, with all that is stated of it, to a mesh made from it.
void append_vertex(TriangleMesh& to, const TriangleMesh& from, uint32_t v);

/// Appends a vertex that lies between vertices of `from`.
///
/// Position, normal and colour are weighted means. Nothing becomes better than what it was made
/// from: support is the smallest, sigma is a weighted mean, and NaN as soon as one vertex that
/// takes part states none.
void append_blend(TriangleMesh& to, const TriangleMesh& from, std::span<const VertexShare> shares);

/// Lets a vertex speak for another one, too, that becomes one with it: the smallest support and the
/// largest sigma, NaN as soon as one states none. All else stays.
void take_weaker_claims(TriangleMesh& mesh, uint32_t kept, uint32_t other);

/// Whether the colours of two vertices differ by more than a texture does from itself at its seams,
/// 0.1 of a channel; false without colours.
bool are_of_other_colors(const TriangleMesh& mesh, uint32_t a, uint32_t b);

/// Of a mesh the faces all of whose corners are kept, and the vertices these use; of a point cloud
/// the points that are kept. All attributes stay.
/// \pre keep holds 0 or 1 for every vertex
TriangleMesh with_vertices(const TriangleMesh& mesh, const std::vector<uint8_t>& keep);

/// Two meshes in the same frame as one.
///
/// What only one of them states is filled in for the other so that nothing is claimed: faces are
/// Inferred, sigma is NaN, support 0, colour grey; normals come from the faces (0 without).
TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace cgs
