// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
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

/// Mean over all pixels of sqrt(1 + q) - 1, where depth is measured, with
/// q = Sum w (z - measured)^2 / sigma^2 + (1 - alpha): what a ray meets shall lie at the measured
/// depth, all of it, and what is missing counts as one sigma off.
///
/// \param measured  NaN = not measured, which adds nothing
/// \param gradient  its alpha, depth_sum and depth_square_sum are added to
/// Source: Deng et al. 2022, "Depth-supervised NeRF", whose rays end in a normal distribution
///         around the depth; here its variance, robust, for Gaussians that are sums already.
double depth_spread(const TrainingBuffers& rendered,
                    const DepthMap& measured,
                    const DepthMap& sigma,
                    double weight,
                    TrainingBuffers& gradient);

/// Mean over all pixels of alpha - Sum w^2: 0 where a ray meets nothing, or one Gaussian that is
/// opaque.
///
/// \param gradient  its alpha and weight_square_sum are added to
/// Source: Seo et al. 2023, "FlipNeRF", emptiness; here the quadratic form of it.
double emptiness(const TrainingBuffers& rendered, double weight, TrainingBuffers& gradient);

/// Where nothing is to stand before a camera.
struct SpaceBefore {
  const Camera& camera;
  double near;  ///< Up to this z-depth [internal units]; >= 0.
};

/// Mean over the first `count` Gaussians of the opacity of those that a camera sees nearer than
/// `near`.
///
/// \param count     at most that of all; those behind it, such as a pane, may stand anywhere
/// \param gradient  with respect to the opacities; one entry per Gaussian, or empty
/// Source: Yang et al. 2023, "FreeNeRF", occlusion regularisation.
double near_opacity(const Gaussians& gaussians,
                    size_t count,
                    const SpaceBefore& space,
                    double weight,
                    std::vector<float>& gradient);

/// What a view measured: z-depth, NaN = not measured, and its standard deviation.
struct MeasuredView {
  const Camera& camera;
  const DepthMap& measured;
  const DepthMap& sigma;
};

/// Sum, over the number of all Gaussians, of the opacity of those of `which` that stand before what
/// a view measured, by more than three sigma and 1 % of its depth.
///
/// \param which     indices of Gaussians, each at most once
/// \param gradient  with respect to the opacities; one entry per Gaussian, or empty
/// Source: Somraj and Soundararajan 2023, "ViP-NeRF", visibility prior; here of measured depth.
double seen_through(const Gaussians& gaussians,
                    std::span<const uint32_t> which,
                    const MeasuredView& view,
                    double weight,
                    std::vector<float>& gradient);

/// Sum, over the number of pixels, of |log(depth ratio)| exp(-10 |difference of colours|) of pairs
/// of neighbours with known depth of which at most one is measured; colours as the mean over
/// channels.
///
/// \param measured  NaN = not measured
/// \param gradient  dL/d(depth) is added to it
/// Source: the edge-aware smoothness of Godard et al. 2017, "Unsupervised monocular depth estimation
///         with left-right consistency", in the place that GeoRGS (Liu et al. 2024) gives it.
double edge_smoothness(const DepthMap& depth,
                       const ColorPlanes& photograph,
                       const DepthMap& measured,
                       double weight,
                       Raster<float>& gradient);

/// Two pixels of a view, row-major, of which one is nearer.
struct DepthOrder {
  uint32_t nearer;
  uint32_t farther;
};

/// What given depth says about the order of pixels.
struct DepthOrders {
  std::vector<DepthOrder> pairs;
  bool is_disparity = false;  ///< Given values are larger where it is nearer.
};

/// Draws pairs of pixels within patches of 32 x 32 whose given depths differ clearly and that are
/// not both measured. Whether larger values are farther is what most measured pairs say; a patch
/// whose measured pairs contradict that (more than three in ten of eight or more) gives none.
///
/// \param given     of any scale and offset; NaN = none
/// \param measured  z-depth, NaN = not measured; of the same size
DepthOrders depth_orders(const DepthMap& given, const DepthMap& measured);

/// Mean over pairs of max(0, log(nearer depth / farther depth) + 0.0001).
/// Source: Wang et al. 2023, "SparseNeRF", depth ranking.
double depth_order(const DepthMap& depth,
                   std::span<const DepthOrder> order,
                   double weight,
                   Raster<float>& gradient);

/// Mean over patches of 16 x 16 of the mean square difference between depth and given depth, each
/// brought to mean 0 and deviation 1 in the patch. Patches of fewer than eight pixels with both, or
/// where one of them is flat, add nothing.
///
/// \param is_disparity  given values are compared with 1 / depth
/// Source: Li et al. 2024, "DNGaussian", local normalisation of depth.
double patch_depth(const DepthMap& depth,
                   const DepthMap& given,
                   bool is_disparity,
                   double weight,
                   Raster<float>& gradient);

}  // namespace cgs
