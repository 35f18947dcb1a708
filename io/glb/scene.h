// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

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
};

/// Every mesh of the default scene of a binary glTF file (of all nodes, if it has no scenes), in
/// the order of the nodes.
/// \throws BadInput Unsupported for a required extension that is not known; Ref for a node with two
///         parents; Schema, Count, Value for a node's matrix; LimitError for nodes too deep
std::vector<GlbInstance> glb_instances(const GlbContainer& file);

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

/// What asset.extras of write_glb() and write_splat_glb() say.
/// \throws BadInput
GlbOrigin glb_origin(const GlbContainer& file);

}  // namespace cgs
