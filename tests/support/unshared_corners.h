// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>

#include "libcgs/core/measurable_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::test {

/// The same surface, every face of it with corners of its own, as STL files have them.
inline MeasurableMesh unshared_corners(const MeasurableMesh& mesh) {
  MeasurableMesh out;
  for (const auto& f : mesh.mesh.faces) {
    const auto first = static_cast<uint32_t>(out.points.size());
    for (const uint32_t v : f) out.points.push_back(mesh.points[v]);
    out.mesh.faces.push_back({first, first + 1, first + 2});
  }
  return with_vertices(std::move(out));
}

}  // namespace cgs::test
