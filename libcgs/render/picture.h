// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// The rendered colour as a picture: divided by alpha where alpha reaches one half, so that it is
/// that of the surface alone; elsewhere what is drawn lies over the background, which holes without
/// colour show. Values in [0, 1].
/// \pre the buffers are drawn on black, the default of RasterizerOptions::background
ColorImage picture(const RenderBuffers& buffers,
                   const Eigen::Vector3f& background = Eigen::Vector3f::Zero());

/// picture() for people to look at: what less than half of a pixel covers is filled up with the
/// colours around it, those of the far side where one side is nearer than the other, as gaps open
/// behind edges. No photograph saw that: the hole mask of the buffers says where. Other pixels are
/// those of picture(), and all are where nothing reaches one half.
///
/// Source: pull and push, Gortler et al. 1996, "The Lumigraph", 3.4, here with weights by depth.
ColorImage filled_picture(const RenderBuffers& buffers);

/// What a picture shows whose holes are filled by Gaussians that somebody made up: these lie over
/// what is drawn in holes, which no photograph vouches for, be it nearer or not. Other pixels, and
/// holes as such, stay as they are.
/// \param fill  the buffers of these Gaussians alone, of the same camera
RenderBuffers with_fill(RenderBuffers buffers, const RenderBuffers& fill);

/// Whether a pixel of with_fill() shows the fill.
inline bool shows_fill(const RenderBuffers& buffers, const RenderBuffers& fill, size_t pixel) {
  constexpr float kShown = 0.5f;
  return is_hole(buffers.hole.data[pixel]) && fill.alpha.data[pixel] >= kShown;
}

}  // namespace cgs
