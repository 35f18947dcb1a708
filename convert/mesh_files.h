// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/certificate.h"
#include "meshing/watertight.h"

namespace cgs {

/// "certificate" of a report: {"closed", "edge_manifold", "vertex_manifold", "oriented",
/// "self_intersections", "components", "genus", "volume"} and the areas by provenance, in file
/// units.
nlohmann::ordered_json certificate_to_json(const Certificate& certificate,
                                           const TriangleMesh& mesh,
                                           const Frame& frame);

/// Writes surface.ply, watertight.ply and, where the scale is known, watertight.{stl,3mf}. (The OBJ
/// may carry photographs, which not every caller has.)
/// `up` is the world direction that becomes +Z in STL and 3MF.
/// \return {"files": […], "left_out": {"watertight.stl": "why", …}}
nlohmann::ordered_json write_mesh_files(const std::filesystem::path& folder,
                                        const TriangleMesh& open_surface,
                                        const TriangleMesh& watertight,
                                        const Frame& frame,
                                        const Eigen::Vector3d& up);

}  // namespace cgs
