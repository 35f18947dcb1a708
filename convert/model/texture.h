// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include "libcgs/core/photo_texture.h"
#include "libcgs/core/scene.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Loads the input photographs of a scene, chooses one for every face, and levels their exposure.
/// \param scene   in the frame of the mesh
/// \param report  set to {"views": [{"name", "faces", "area", "gain": [r, g, b], "samples"}],
///   "faces_without_view" and "area_without_view" (of seen surface), "largest_stretch" (distance
///   between linear texture coordinates and the projection, at the middles of edges) [pixels],
///   "units", "seam_length", "seam_length_unsmoothed"}; or to {"left_out": "why"}
/// \return empty if a photograph is missing
PhotoTexture texture_from_photographs(const Scene& scene,
                                      const TriangleMesh& mesh,
                                      nlohmann::ordered_json& report);

/// The size of a pixel on the surface [internal units], of the photograph where it is smallest, by
/// the median over the faces that show it; 0 where none is shown.
double texel_size(const PhotoTexture& texture, const TriangleMesh& mesh);

/// Makes photographs smaller whose pixels cover less of the surface than `texel` [internal units],
/// by the median over the faces that show them, until they cover that; none below 16 pixels.
/// \return the largest share of its width that a photograph in use keeps, 1 if there is none
double coarsen_texture(PhotoTexture& texture, const TriangleMesh& mesh, double texel);

}  // namespace cgs
