// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/render/training_rasterizer.h"

namespace cgs {

/// What splats are to look like in one camera.
struct PictureToMatch {
  Camera camera;
  ColorPlanes color;    ///< On black.
  Raster<float> alpha;  ///< [0, 1]
};

/// The pictures that splats give.
/// \throws as TrainingRasterizer::forward()
std::vector<PictureToMatch> pictures_to_match(const Gaussians& gaussians,
                                              std::span<const Camera> cameras);

/// Changes splats a little so that they look more like given pictures: opacity, constant colour,
/// scales and centres, by `passes` steps of Adam on the squared differences of colour and alpha,
/// one picture after the other. Centres go by parts of pixels; rotations stay. Same bits for any
/// number of threads.
///
/// \param pixel  as WeighedSplats has it
/// \throws as TrainingRasterizer::forward()
void refit_splats(Gaussians& gaussians,
                  const std::vector<float>& pixel,
                  std::span<const PictureToMatch> pictures,
                  size_t passes);

}  // namespace cgs
