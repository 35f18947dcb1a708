// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"
#include "libcgs/render/training_rasterizer.h"

namespace cgs {

/// What splats are to look like in one camera.
struct PictureToMatch {
  Camera camera;
  ColorPlanes color;    ///< On black.
  Raster<float> alpha;  ///< [0, 1]
};

/// The pictures that splats give.
/// \throws Error as TrainingRasterizer::forward()
std::vector<PictureToMatch> pictures_to_match(const Gaussians& gaussians,
                                              std::span<const Camera> cameras);

/// Mean squared difference of two pictures from one camera, over their three channels, on black and
/// on white: what lets more through is told from what is darker. Of pixels where either has an
/// alpha of one half or more; 0 if there are none.
/// \pre both have the same size
double mean_square_difference(const PictureToMatch& a, const PictureToMatch& b);

/// Changes splats a little so that they look more like given pictures: opacity, constant colour,
/// scales and centres, by `passes` steps of Adam on the squared differences on black and on white,
/// of all pixels, one picture after the other. Centres go by parts of pixels; rotations stay.
/// Scales grow by at most a fifth: what the pictures show from its end could grow along their rays
/// at no cost, and would be a veil to a camera that comes nearer. Same bits for any number of
/// threads.
///
/// \param pixel  as WeighedSplats has it
/// \throws Error as TrainingRasterizer::forward(); what `progress` throws
void refit_splats(Gaussians& gaussians,
                  const std::vector<float>& pixel,
                  std::span<const PictureToMatch> pictures,
                  size_t passes,
                  const Progress& progress = {});

}  // namespace cgs
