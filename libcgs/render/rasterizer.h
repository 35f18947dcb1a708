// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/render/projection.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// How Gaussians are drawn.
struct RasterizerOptions {
  Eigen::Vector3f background = Eigen::Vector3f::Zero();  ///< Shown through what is transparent.
  float min_alpha = 0.5f;           ///< Pixels less opaque than this have no depth; in (0, 1].
  float dilation = kSplatDilation;  ///< ProjectionOptions::dilation [pixels^2].
  float near_depth = 1e-3f;         ///< ProjectionOptions::near_depth [internal units].

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// How many Gaussians of a set met which fate in one view.
struct RasterizerReport {
  size_t drawn = 0;
  size_t degenerate = 0;   ///< Not finite, zero quaternion, negative scale or three zero scales.
  size_t transparent = 0;  ///< Opacity below 1/255.
  size_t behind = 0;       ///< Nearer than near_depth, or behind the camera.
  size_t outside = 0;      ///< Beside the image.
};

/// Renders Gaussians into one camera by front-to-back blending in order of centre depth.
///
/// alpha_i = min(0.99, opacity_i * exp(-q_i / 2)), left out below 1/255; w_i = alpha_i * T, with T
/// the transmittance of what lies in front; a pixel is finished when T < 1e-4. Unlike 3DGS, the
/// Gaussian that takes T below that is still blended, so that the weights and T sum to 1.
/// The depth of a Gaussian is that of its centre everywhere in its footprint. Results are the same
/// bits for any number of threads. Fills every raster of RenderBuffers but support and hole.
///
/// \param report  if given, receives the counts of this view
/// \throws InvalidInput as project_gaussians(), or if an option is out of range.
/// \throws LimitError if the splats cover so many tile rows that their list would not fit 4 GiB.
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering".
RenderBuffers rasterize(const Gaussians& gaussians,
                        const Camera& camera,
                        const RasterizerOptions& options = {},
                        RasterizerReport* report = nullptr);

}  // namespace cgs
