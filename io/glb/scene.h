// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "io/glb/container.h"

namespace cgs {

/// The extension of splats, and the prefix of their attributes.
inline constexpr const char* kGaussianSplatting = "KHR_gaussian_splatting";

/// A mesh of the scene, and where its node puts it.
struct GlbInstance {
  JsonValue mesh;  ///< Refers to the container.
  Eigen::Affine3d gltf_from_mesh = Eigen::Affine3d::Identity();
  std::optional<JsonValue> weights = {};  ///< Of morph targets: the node's, else the mesh's.
};

/// What a file shows.
struct GlbScene {
  std::vector<GlbInstance> instances;  ///< In the order of the nodes.
  std::vector<std::string> warnings;   ///< One line each: what the file holds beside it.
};

/// Every mesh of the default scene of a glTF file (of all nodes, if it has no scenes), but for
/// those that KHR_node_visibility hides.
/// \throws BadInput Unsupported for a required extension that is not known, or for a skin; Ref for
///         a node with two parents; Schema, Count, Value for a node's matrix; LimitError for nodes
///         too deep, and for meshes shown more than 2^20 times
/// Source: glTF 2.0, section 3.5, EXT_mesh_gpu_instancing and KHR_node_visibility, Khronos Group.
GlbScene glb_scene(const GlbContainer& file);

/// Scale and place of a file in the world; that of other programs' files is the identity.
struct GlbOrigin {
  bool is_ours = false;
  bool had_labels = false;  ///< As it was written.
  Eigen::Matrix3d world_from_gltf = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double units_per_metre = 1;  ///< World units per unit of the file.
  /// Scale and unit in the words of ply_frame_comments(); metres, assumed, for other programs'.
  std::vector<std::string> comments;

  Eigen::Vector3d world(const Eigen::Vector3d& p) const {
    return origin + units_per_metre * (world_from_gltf * p);
  }
};

/// What asset.extras of write_glb() and write_splat_glb() say. Where "origin_in_world" is not 0, as
/// in files of earlier versions, whose nodes do not say where they lie, (0, 0, 0) of the file lies
/// there.
/// \throws BadInput
GlbOrigin glb_origin(const GlbContainer& file);

}  // namespace cgs
