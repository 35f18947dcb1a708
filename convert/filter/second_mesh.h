// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "convert/filter/state.h"

namespace cgs {

/// A second mesh or point cloud, in the frame of the first.
struct SecondMesh {
  TriangleMesh mesh;
  std::string remark;  ///< Its size, and what else the user should know of it.
};

/// Reads what an operation joins to the state, whose scale becomes no surer than either one is.
/// \throws InvalidInput that names the operation if one of the two is a point cloud, or only one
///         states its unit; as read_mesh_file()
SecondMesh read_second_mesh(FilterState& state,
                            const std::filesystem::path& path,
                            const char* operation);

}  // namespace cgs
