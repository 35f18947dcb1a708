// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/photo_texture.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What graphics cards of the last ten years hold, those of telephones included [pixels].
inline constexpr int kLargestAtlasSide = 8192;

/// A texture in one picture, and the size of its pixels.
struct PackedTexture {
  PhotoTexture texture;  ///< Its photographs are the charts, each a part of one photograph.
  double texel = 0;      ///< Of the finest charts, on the surface [internal units].
};

/// Packs what faces show of photographs into one picture. Connected faces of one photograph are a
/// chart, which keeps their projection, so that no pixel is resampled but for size; charts of one
/// photograph that lie so close that they take no more room together are one.
///
/// \param texel  what pixels of finer charts are made as large as, by their medians [internal
///               units]; 0 = as photographs have them. Where all does not fit into
///               kLargestAtlasSide squared, it becomes larger until it does.
/// \pre the texture fits the mesh and has no atlas; some face shows a photograph
PackedTexture packed_texture(const TriangleMesh& mesh, const PhotoTexture& texture, double texel);

}  // namespace cgs
