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

/// Multi-scale structural similarity: the product over five levels, each of 2x2 means of the one
/// before it, of mean structure terms (contrast times structure) to the power of the level's
/// weight, where the coarsest level counts with its whole mean SSIM; then the mean over channels,
/// in [0, 1].
///
/// Constants and weights within windows are those of ssim(), but only windows that lie inside the
/// image count, as in the authors' program. Negative means count as 0. Images under 176 pixels
/// have fewer levels: those whose sides hold a window of 11 pixels, with exponents scaled to sum
/// to 1. There is no form with a mask, which would have no meaning at the coarse levels.
///
/// \return NaN if the images are smaller than a window
/// \throws InvalidInput if sizes differ or there is no pixel.
/// Source: Wang, Simoncelli and Bovik 2003, "Multi-scale structural similarity for image quality
///         assessment", Eq. 7 and the exponents of section 3.2.
double ms_ssim(const ColorImage& a, const ColorImage& b);

}  // namespace cgs
