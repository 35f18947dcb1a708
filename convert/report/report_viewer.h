// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/mesh_distance.h"

namespace cgs {

/// The mesh as a page shows it: the mesh itself, or one with fewer faces and how far that is off.
struct ShownMesh {
  TriangleMesh mesh;
  size_t faces_before = 0;
  MeshDistance evidence;  ///< As in SimplifyResult [internal units]; 0 if nothing was left out.
  MeshDistance inferred;
};

/// A mesh with about `most_faces` faces, if it can be had within 1/100 of its size and with every
/// label keeping its area; else the nearest to it that can.
/// \pre mesh has faces
ShownMesh shown_mesh(const TriangleMesh& mesh, size_t most_faces, const Progress& progress);

/// What the shown faces are, in words, as HTML: lengths in the unit of the viewer's figures.
std::string shown_text(const ShownMesh& shown, const Frame& frame);

/// What the viewer of the report shows, as viewer.js reads it: the mesh with its evidence in the
/// frame of the model, photographs as its texture, input cameras, a sample of the Gaussians, what
/// fills their holes, and how to get to the coordinates of files and the unit of figures. Arrays
/// are base64 of little-endian numbers.
/// \param fill  synthetic Gaussians; may be empty
nlohmann::ordered_json viewer_scene(const Model& model,
                                    const TriangleMesh& mesh,
                                    const Gaussians& fill = {});

/// The section of the report page with the viewer and all it needs, as HTML: no other file, no
/// network. Without three.js at build time, a sentence that says so.
/// \param watertight  in the frame of the model; not empty
/// \param fill        as viewer_scene() takes it
std::string viewer_section(const Model& model,
                           const TriangleMesh& watertight,
                           const Gaussians& fill,
                           const Progress& progress);

}  // namespace cgs
