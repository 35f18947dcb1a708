// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/image.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// A picture as it lies in the file, turned upright; `orientation` as exif_orientation() gives it.
ColorImage turned(const ColorImage& stored, int orientation);
MaskMap turned(const MaskMap& stored, int orientation);
ImageSize turned(const ImageSize& stored, int orientation);

/// Size of the photograph of a view [pixels] and the photograph itself, turned as the view says.
/// \throws BadInput, LimitError as image_size() and read_image()
ImageSize photograph_size(const View& view);
ColorImage read_photograph(const View& view, MaskMap* usable = nullptr);

}  // namespace cgs
