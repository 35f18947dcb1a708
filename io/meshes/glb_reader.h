// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// A mesh or point cloud from a glTF file, and where it says up is.
struct GlbMesh {
  ParsedMesh parsed;
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();  ///< Unit length, in the axes of the positions.
};

/// Reads every triangle of the default scene of a glTF file, binary or text with files beside it
/// (of all nodes, if it has no scenes), plain, quantised (KHR_mesh_quantization) or compressed
/// (KHR_draco_mesh_compression), nodes placed and morph targets weighted as the file says. Vertices
/// at one place become one: the format repeats them wherever normals, textures or materials change.
/// A file without triangles is a cloud of its points, with their normals. What is left out is
/// counted in warnings; what is not finite is dropped, see drop_unusable().
///
/// Files of ours lead back to world coordinates, with unit, labels and sigma; a warning says where
/// labels were lost. Others are in metres with +Y up, as the format demands, and have labels where
/// MaterialLabels finds them in names of materials. Colours of vertices are what GlbColors
/// makes of theirs, materials and textures.
///
/// \throws BadInput as GlbContainer; Empty without triangles and points; Unsupported for an
///         extension that changes the geometry, or skins; Ref for a node with two parents; Value
///         as drop_unusable(), and for positions that floats round too much, as
///         check_significance(); LimitError
/// Source: glTF 2.0, KHR_mesh_quantization and KHR_draco_mesh_compression, Khronos Group.
GlbMesh read_glb(const std::filesystem::path& path);
/// The same for the content of a file, whose name is for messages.
GlbMesh parse_glb(std::string content, const std::filesystem::path& path);

}  // namespace cgs
