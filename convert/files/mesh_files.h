// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "io/meshes/gltf.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/certificate.h"
#include "meshing/surface/watertight.h"

namespace cgs {

/// "certificate" of a report: {"closed", "edge_manifold", "vertex_manifold", "oriented",
/// "self_intersections", "components", "genus", "volume"} and the areas by provenance, in file
/// units.
nlohmann::ordered_json certificate_to_json(const Certificate& certificate,
                                           const TriangleMesh& mesh,
                                           const Frame& frame);

/// Files below one folder.
struct MeshFiles {
  std::vector<std::string> written;
  std::vector<std::pair<std::string, std::string>> left_out;  ///< With the reasons, for people.
};

/// {"files": […], "left_out": {"watertight.stl": "why", …}}
nlohmann::ordered_json mesh_files_to_json(const MeshFiles& files);

/// Writes surface.ply, watertight.ply and, where the scale is known, watertight.{stl,3mf}. (The OBJ
/// may carry photographs, which not every caller has.)
/// In STL and 3MF frame.up, which must be known, becomes +Z. Where the scale is unknown, those that
/// this program wrote before are removed.
/// \throws NumericalError where there is no surface
MeshFiles write_mesh_files(const std::filesystem::path& folder,
                           const TriangleMesh& open_surface,
                           const TriangleMesh& watertight,
                           const Frame& frame);

/// True for the endings that write_mesh_as() takes: .ply, .obj, .stl, .om, .3mf, .glb, in any
/// case.
bool is_writable_mesh_name(const std::filesystem::path& path);

/// True for the endings whose format says which axis is up, so that a mesh is turned: .stl, .3mf
/// and .glb. What else is written keeps its axes, and says what is up only where that is known.
bool is_turned_upright(const std::filesystem::path& path);

/// What was assumed to be up in a file that did not say it, where that decides how the file that is
/// written lies, for a note; empty where it does not.
/// \param assumed  of MeasurableFile, or of settle_up()
std::string assumed_up_text(const std::filesystem::path& from,
                            const std::filesystem::path& to,
                            const std::string& assumed);

/// What can be refused before any work: STL and 3MF of a scene of unknown scale.
/// \throws InvalidInput
void require_writable_as(const std::filesystem::path& path, const Frame& frame);

/// Says that a mesh falls apart where many of its vertices lie in one place, and what helps; empty
/// if it does not.
std::string seams_text(const TriangleMesh& mesh);

/// Says that a mesh from a file with textures has their colours at its vertices only; empty
/// without.
std::string textures_text(bool has_textures);

/// Says that coordinates in a written file are from another origin than those that were read, for a
/// warning; empty if not.
std::string moved_origin_text(const std::filesystem::path& path,
                              const Eigen::Vector3d& read,
                              const Eigen::Vector3d& written);

/// Says, of a .glb that is written, where its (0, 0, 0) lies if that is a local origin, or else
/// that the content lies so far from it that programs in single precision cannot place it well;
/// empty where there is nothing to say.
std::string glb_place_text(const std::filesystem::path& path,
                           const Frame& frame,
                           bool has_local_origin);

/// What the format of a path has no place for, of what a mesh says, for people; empty if nothing.
std::string lost_in_file(const std::filesystem::path& path,
                         const TriangleMesh& mesh,
                         const Frame& frame);

/// Writes a mesh in the format that the ending of the path names.
/// \param frame    whose `up` becomes +Z in STL and 3MF, +Y in GLB, and must be known for these
/// \param options  for a GLB; its y_up is set from there
/// \return what the encoding of a GLB lost of the mesh, for people; empty if nothing
/// \throws Error as the writers and require_writable_as()
std::string write_mesh_as(const std::filesystem::path& path,
                          const TriangleMesh& mesh,
                          const Frame& frame,
                          GlbOptions options = {});

}  // namespace cgs
