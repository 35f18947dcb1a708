// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// The rendered colour as a picture: divided by alpha where alpha reaches one half, black in holes
/// without colour. Values in [0, 1].
ColorImage picture(const RenderBuffers& buffers);

/// picture() for people to look at: what less than half of a pixel covers is filled up with the
/// colours around it, those of the far side where one side is nearer than the other, as gaps open
/// behind edges. No photograph saw that: the hole mask of the buffers says where. Other pixels are
/// those of picture(), and all are where nothing reaches one half.
///
/// Source: pull and push, Gortler et al. 1996, "The Lumigraph", 3.4, here with weights by depth.
ColorImage filled_picture(const RenderBuffers& buffers);

}  // namespace cgs
