// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/raster.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// Depth as a picture: near red, far blue (Google's turbo map), linear in inverse depth between
/// the 1st and 99th percentile; unknown depth is black.
ColorImage depth_picture(const DepthMap& depth);

/// (n + 1) / 2 per axis, in camera axes with +y up and +z towards the camera, as normal maps are
/// usually shown; unknown is black.
ColorImage normal_picture(const NormalMap& normals, const Eigen::Isometry3d& cam_from_world);

/// 1 = hole.
MaskMap hole_mask(const RenderBuffers& buffers);

/// Pixels of both masks; an empty `b` has all.
MaskMap intersection(const MaskMap& a, const MaskMap& b);

/// sRGB-coded colours that mark what pictures show: holes, and what was painted there.
inline const Eigen::Vector3f kHoleTint(0.9f, 0.1f, 0.8f);
inline const Eigen::Vector3f kPaintedTint(0.45f, 0.15f, 1);

/// A picture with its masked pixels in a colour, through which it shines a little.
ColorImage tinted(ColorImage picture, const MaskMap& mask, const Eigen::Vector3f& tint = kHoleTint);

/// Pictures side by side, row by row, smaller ones amid places for the largest.
/// \pre pictures are not empty, columns > 0
ColorImage contact_sheet(const std::vector<ColorImage>& pictures, int columns);

}  // namespace cgs
