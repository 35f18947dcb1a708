// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/camera.h"
#include "libcgs/core/halved.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/render/training_rasterizer.h"

namespace cgs {

/// What one input view is compared with; all rasters are of the camera's size.
struct TrainingView {
  Camera camera;
  ColorPlanes photograph;  ///< Of a grey one, three times the luminance.
  bool is_grey = false;
  MaskMap use;            ///< Pixels of the photograph that may be used; empty = all.
  Raster<uint8_t> layer;  ///< As ViewPriors::layer.
  DepthMap measured;      ///< Depth where it is measured, else NaN [internal units].
  DepthMap sigma;         ///< Standard deviation of it.
};

/// \param view  with its image
TrainingView training_view(const View& view, const ViewPriors& priors);

/// The view at half its size. Colours are means of four pixels, of which all must be usable; of
/// layers and depth every other pixel is taken. Odd rows and columns at the end are cut off.
TrainingView halved(const TrainingView& view);

/// The derivative with respect to an image whose 2x2 means the loss was taken of. Empty stays
/// empty.
Raster<float> spread(const Raster<float>& gradient);

/// Calls change(raster) for every raster of the buffers.
template <typename Change>
void for_each_raster(TrainingBuffers& buffers, const Change& change) {
  for (Raster<float>& plane : buffers.color) change(plane);
  change(buffers.alpha);
  change(buffers.depth_sum);
  change(buffers.depth_square_sum);
  change(buffers.weight_square_sum);
}

}  // namespace cgs
