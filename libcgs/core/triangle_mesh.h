// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/provenance.h"

namespace cgs {

/// An indexed triangle mesh with its evidence. Optional arrays are empty or as long as vertices.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;       ///< [internal units]
  std::vector<std::array<uint32_t, 3>> faces;  ///< Counter-clockwise seen from outside.
  std::vector<Eigen::Vector3f> normals;        ///< Optional; unit length, outward.
  std::vector<Eigen::Vector3f> colors;         ///< Optional; sRGB-coded RGB in [0, 1].
  std::vector<float> support;                  ///< Optional; number of input views that see it.
  std::vector<float> sigma;  ///< Optional; standard deviation along the normal [internal units],
                             ///< NaN = no statement (inferred, estimated).
  std::vector<Provenance> provenance;  ///< Optional; one per face.
};

/// Twice the area of a face times its unit normal; in double, because thin faces far out cancel.
Eigen::Vector3d area_vector(const TriangleMesh& mesh, const std::array<uint32_t, 3>& face);

/// The area of a face [internal units squared].
double face_area(const TriangleMesh& mesh, const std::array<uint32_t, 3>& face);

/// Area-weighted vertex normals from the faces; 0 where a vertex has no face of positive area.
std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh);

/// Total face area per provenance label, index = label [internal units squared].
std::array<double, kProvenanceCount> area_by_provenance(const TriangleMesh& mesh);

}  // namespace cgs
