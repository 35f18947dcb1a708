// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cgs {

/// The faces around every vertex.
struct VertexFaces {
  std::vector<uint32_t> first;  ///< Where those of a vertex begin in `faces`; at the end, its size.
  std::vector<uint32_t> faces;  ///< Of each vertex in ascending order.

  std::span<const uint32_t> of(size_t vertex) const {
    return {faces.data() + first[vertex], faces.data() + first[vertex + 1]};
  }
};

/// Lists the faces around every vertex; one that names a vertex twice stands there twice.
/// \pre corners are below `vertices`; fewer than 2^32 of them in all
VertexFaces faces_of_vertices(size_t vertices, std::span<const std::array<uint32_t, 3>> faces);

}  // namespace cgs
