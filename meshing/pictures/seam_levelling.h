// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/photo_texture.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

struct SeamLevellingOptions {
  /// Over so many pixels of photographs what is added at a seam falls by a factor of e: colours
  /// farther away stay as they were taken. > 0
  double reach = 300;
  /// Two photographs are joined as if so many pixels lay between them: steps that change faster
  /// than that along a seam are of detail that lies a little off, and are hardly followed. > 0
  double gap = 30;
  /// A step of so much counts half: larger ones are of surface that is not where the mesh has it,
  /// or of gloss, and not of light. > 0 [of 1, sRGB-coded]
  double outlier = 0.03;

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Differences of colour along seams, the mean of the channels [of 1, sRGB-coded].
struct SeamLevelling {
  double step_before = 0;  ///< 0 where there are no seams.
  double step_after = 0;
};

/// Makes photographs meet in colour where a face of one borders on a face of another. What is added
/// to them is a membrane over the faces of each, as smooth as it can be, joined to the others along
/// the seams and drawn to 0. Steps are medians over the faces around, less what their scatter
/// explains: detail that lies a little off is no light.
/// \param texture  its photographs are changed where faces show them, and 8 pixels around
/// \param pixel    size of a pixel of the photographs on the surface [internal units]
/// \pre the texture fits the mesh
/// Source: seams as in Lempitsky & Ivanov 2007, "Seamless Mosaicing of Image-Based Texture Maps",
///         section 4, here with the area of faces for weights and a term that keeps colours.
SeamLevelling level_seams(const TriangleMesh& mesh,
                          PhotoTexture& texture,
                          double pixel,
                          const SeamLevellingOptions& options = {});

}  // namespace cgs
