// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"
#include "libcgs/priors/pixel_matches.h"
#include "libcgs/render/training_rasterizer.h"

namespace cgs {

// Every term returns weight * value and adds weight * derivative to the gradient it is given,
// creating rasters, filled with zero, that are empty. A weight of 0 returns 0 and touches nothing.
// Sums are taken in double, row by row in a fixed order: the same bits for any number of threads.
// Where a term has a kink its derivative is 0. All throw InvalidInput if sizes differ or nothing
// is there. Each term is in the source of its name.

/// Mean absolute difference at full, half, ... resolution (2x2 means, odd rows and columns left
/// out), levels weighted 1, 1/4, 1/8, 1/16, ...; pixels outside `use` take the photograph's value.
/// Source: Paliwal et al. 2024, "CoherentGS", published implementation.
///
/// \param levels  >= 1; levels smaller than a pixel are skipped
/// \param use     if given, only its non-zero pixels count; means stay over all pixels
double multi_scale_l1(const ColorPlanes& rendered,
                      const ColorPlanes& photograph,
                      const MaskMap* use,
                      int levels,
                      double weight,
                      ColorPlanes& gradient);

/// 1 - SSIM with the window and constants of ssim() in train/image_metrics.h.
/// Arithmetic is in float, in a form whose error is relative to 1 - SSIM, not to 1.
///
/// \param use  as in multi_scale_l1()
double structural_dissimilarity(const ColorPlanes& rendered,
                                const ColorPlanes& photograph,
                                const MaskMap* use,
                                double weight,
                                ColorPlanes& gradient);

/// Total variation of the rendered disparity A unit / (A unit + D), with A = alpha + 1e-6 and D =
/// depth_sum: mean |difference| along x plus mean |difference| along y, each over its pairs of
/// neighbours whose alpha is at least 0.05. With layers, only pairs within one layer count
/// ("masked"). Without a pair the mean is 0.
///
/// \param unit      depth at which disparity is 1/2 [internal units]
/// \param layer     layer of every pixel, or null
/// \param gradient  its alpha and depth_sum are added to
/// Source: Paliwal et al. 2024, "CoherentGS", section 3; stable form A' / (A' + D).
double total_variation(const TrainingBuffers& rendered,
                       float unit,
                       const Raster<uint8_t>* layer,
                       double weight,
                       TrainingBuffers& gradient);

/// Mean over all pixels of the first view of the L1 distance (the sum of three coordinates)
/// between the 3D points that two depth maps give at corresponding places; the second depth is
/// interpolated bilinearly in inverse depth. Correspondences whose pixel, or one of the four
/// pixels around whose place, is unknown or outside add nothing.
///
/// \param gradient_first   dL/d(depth of first) is added to it
/// \param gradient_second  dL/d(depth of second) is added to it
/// Source: Paliwal et al. 2024, "CoherentGS", flow loss; sampling here is at pixel centres.
double flow_consistency(const Camera& first,
                        const DepthMap& depth_first,
                        const Camera& second,
                        const DepthMap& depth_second,
                        std::span<const PixelMatch> matches,
                        double weight,
                        Raster<float>& gradient_first,
                        Raster<float>& gradient_second);

}  // namespace cgs
