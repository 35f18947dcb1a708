// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"

namespace cgs {

/// Peak signal-to-noise ratio -10 log10(mean squared error) over all channels, peak 1 [dB].
///
/// \param use  if given, only its non-zero pixels count
/// \return +infinity for images that are equal there
/// \throws InvalidInput if sizes differ or no pixel counts.
double psnr(const ColorImage& a, const ColorImage& b, const MaskMap* use = nullptr);

/// Structural similarity, the mean of its map over pixels and channels, in [-1, 1].
///
/// Windows are 11x11 Gaussians of sigma 1.5 pixels, zero beyond the border and not renormalised
/// there, with K1 = 0.01, K2 = 0.03 and dynamic range 1: the evaluation of 3DGS. Means and
/// (co)variances are taken in double. With a mask the map is computed from whole images and then
/// averaged over the pixels in use.
///
/// \throws InvalidInput as psnr().
/// Source: Wang et al. 2004, "Image quality assessment: from error visibility to structural
///         similarity", Eq. 13.
double ssim(const ColorImage& a, const ColorImage& b, const MaskMap* use = nullptr);

}  // namespace cgs
