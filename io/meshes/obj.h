// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "libcgs/core/frame.h"
#include "libcgs/core/photo_texture.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Writes a mesh as Wavefront OBJ in file coordinates, and its materials beside it under the same
/// stem with .mtl.
///
/// Vertex colours follow the coordinates ("v x y z r g b", in [0, 1], as most readers of colour
/// expect). Faces are grouped by provenance: "g observed" with material "observed", and so on in
/// the order observed, single_view, interpolated, estimated, inferred, virtual. Comments carry unit
/// and origin. Either both files are written or none.
///
/// \throws InvalidInput if the mesh is not writable (an array does not fit, a vertex is not
///         finite); IoError
void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh, const Frame& frame);

/// The same with photographs as texture: within their group, faces with a photograph have material
/// "observed_PHOTOGRAPH" ("view_PHOTOGRAPH" without labels) and texture coordinates ("vt u v",
/// v upwards), and the used part of the photograph lies beside the file as
/// STEM.PHOTOGRAPH.jpg. Characters that do not belong in such names become '_'. With an atlas,
/// PHOTOGRAPH is "atlas", the one picture.
///
/// All files are written before the first of them is replaced, images first and the .obj last; what
/// was not there before a failure is removed.
/// \throws Error as above; InvalidInput if the texture does not fit the mesh, see require_texture()
void write_obj(const std::filesystem::path& path,
               const TriangleMesh& mesh,
               const PhotoTexture& texture,
               const Frame& frame);

}  // namespace cgs
