// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// A pixel that a Gaussian covers less than this is left alone, as in 3DGS.
inline constexpr float kMinSplatAlpha = 1.0f / 255.0f;

/// How Gaussians are projected.
struct ProjectionOptions {
  float dilation = kSplatDilation;  ///< Added to both image variances [pixels^2]; >= 0.
  float near_depth =
      1e-3f;  ///< Centres nearer than this are culled [internal units]; > 0. Relative
              ///< to the scene because the internal extent lies in [0.5, 1).

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// What became of a Gaussian in one view.
enum class SplatFate : uint8_t {
  Drawn = 0,
  Degenerate = 1,   ///< Not finite, zero quaternion, negative scale or three zero scales.
  Transparent = 2,  ///< Opacity below kMinSplatAlpha.
  Behind = 3,       ///< Centre nearer than near_depth.
  Outside = 4,      ///< Its support misses every pixel centre.
};

/// The footprint of one Gaussian in an image.
///
/// With dx, dy from the centre to a pixel centre and C = (C_xx, C_xy; C_xy, C_yy) the dilated image
/// covariance, the exponent is factored as the Cholesky solve does it, y first:
///   q = dy^2 / C_yy + (dx - slope * dy)^2 / C_x|y,   slope = C_xy / C_yy,   C_x|y = det C / C_yy,
/// and alpha = min(0.99, opacity * exp(-q / 2)) where that is at least kMinSplatAlpha, which
/// implies q <= q_max. Aligned to the cache line that it fills: depth order visits splats at
/// random.
struct alignas(64) Splat {
  double u = 0;  ///< Centre [pixels].
  double v = 0;
  double slope = 0;
  float inv_sigma_y = 0;  ///< 1 / sqrt(C_yy) [1 / pixels]
  float sigma_x = 0;      ///< sqrt(C_x|y) [pixels]
  float half_width = 0;   ///< The support q <= q_max lies in u +- half_width [pixels].
  float q_max = 0;
  float opacity = 0;
  float depth = 0;  ///< z of the centre [internal units].
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
};

/// Inclusive range of pixel rows whose centres the support of a splat can reach; empty when
/// first > last.
struct RowRange {
  int32_t first = 0;
  int32_t last = -1;
};

/// All Gaussians of a set in one view; entries of Gaussians that are not drawn are meaningless
/// but for their fate.
struct ProjectedGaussians {
  std::vector<Splat> splats;
  std::vector<RowRange> rows;  ///< Clipped to the image.
  std::vector<SplatFate> fate;
};

/// A camera as the projection of Gaussians needs it.
struct ProjectionView {
  Eigen::Matrix3d cam_from_world;  ///< Rotation.
  Eigen::Vector3d center;          ///< [internal units]
  Camera camera;
  Eigen::Array2d min_slope;  ///< Of x/z and y/z inside the derivative of the perspective map.
  Eigen::Array2d max_slope;
};

ProjectionView projection_view(const Camera& camera);

/// Projects every Gaussian with the affine approximation of the perspective map at its centre.
///
/// Everything up to the footprint is computed in double, after subtracting the camera centre in
/// double. The determinant of the image covariance is a sum of squares (Cauchy-Binet minors of the
/// 2x3 factor), so that needles and splats far wider than the image stay positive definite. The
/// slopes of the perspective map are taken at x/z and y/z clamped to the image plus 15 % of its
/// size on each side (3DGS: 1.3 times the field of view).
///
/// \throws InvalidInput if the arrays of the set disagree in length, the SH degree is not 0 ... 3,
///         or the camera has no positive size and focal length.
/// Source: Zwicker et al. 2001, "EWA Volume Splatting"; Kerbl et al. 2023, "3D Gaussian Splatting".
ProjectedGaussians project_gaussians(const Gaussians& gaussians,
                                     const Camera& camera,
                                     const ProjectionOptions& options = {});

/// The same into arrays that keep their memory from one call to the next.
void project_gaussians(const Gaussians& gaussians,
                       const Camera& camera,
                       const ProjectionOptions& options,
                       ProjectedGaussians& out);

/// Indices of the drawn Gaussians, nearest first; equal float depths keep index order.
std::vector<uint32_t> depth_order(const ProjectedGaussians& projected);

}  // namespace cgs
