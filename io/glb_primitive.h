// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Faces of one provenance class with vertices of their own, as glTF wants them.
struct GlbPrimitive {
  std::string name;                            ///< Of the class; names the material too.
  std::vector<Eigen::Vector3f> positions;      ///< [units of the file], glTF axes, local origin
  std::vector<Eigen::Vector3f> normals;        ///< Unit length.
  std::vector<Eigen::Vector3f> colors;         ///< Linear light in [0, 1]; may be empty.
  std::vector<float> support;                  ///< May be empty.
  std::vector<float> sigma;                    ///< [units of the file]; may be empty.
  std::vector<std::array<uint32_t, 3>> faces;  ///< No two corners at one place.
};

/// From internal coordinates to those of a glTF file: scale * rotation * (p - center).
struct GlbPlacement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  double scale = 1;  ///< Units of the file per internal unit.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();

  Eigen::Vector3f operator()(const Eigen::Vector3f& p) const {
    return (scale * (rotation * (p.cast<double>() - center))).cast<float>();
  }
};

/// Splits a mesh into its provenance classes, from most to least evidence, classes without faces
/// left out. Vertices keep their order; those without a face are left out.
/// \pre the arrays of the mesh fit
std::vector<GlbPrimitive> glb_primitives(const TriangleMesh& mesh, const GlbPlacement& placement);

}  // namespace cgs
