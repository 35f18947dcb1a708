// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "io/bytes/scene_path.h"
#include "io/images/image.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// A picture as it lies in the file, turned upright; `orientation` as exif_orientation() gives it.
ColorImage turned(const ColorImage& stored, int orientation);
MaskMap turned(const MaskMap& stored, int orientation);
Raster<float> turned(const Raster<float>& stored, int orientation);
ImageSize turned(const ImageSize& stored, int orientation);

/// Where a pixel of the upright picture lies in the file; both numbered from 0.
Eigen::Vector2d stored_pixel(const Eigen::Vector2d& upright,
                             const ImageSize& stored,
                             int orientation);

/// Size of the photograph of a view as image viewers show it, which turn pictures as Exif says
/// [pixels].
/// \throws BadInput as image_size()
ImageSize shown_size(const View& view);

/// True if the shape of a mask or of depth cannot tell whether it lies as the photograph is stored
/// or upright.
/// \throws BadInput as image_size()
bool may_lie_turned(const View& view);

/// Where a pixel that was picked in an image viewer lies in the photograph that the camera of the
/// view is for; both numbered from 0.
/// \return nothing outside of the photograph
/// \throws BadInput as image_size()
std::optional<Eigen::Vector2d> picked_pixel(const View& view, const Eigen::Vector2d& shown);

/// Size of the photograph of a view, turned as the view says [pixels].
/// \throws BadInput, LimitError as image_size()
ImageSize photograph_size(const View& view);
/// The photograph itself, turned likewise.
/// \throws BadInput, LimitError as image_size() and read_image()
ColorImage read_photograph(const View& view);
/// \param usable  receives the pixels neither transparent nor masked, as read_image() gives them, nor
///                in the border of a print, if View::may_have_border
/// \throws BadInput, LimitError as read_photograph() and apply_mask()
ColorImage read_photograph(const View& view, MaskMap& usable);

}  // namespace cgs
