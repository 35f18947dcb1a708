// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussian_gradients.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/raster.h"
#include "libcgs/render/projection.h"

namespace cgs {

/// An RGB image as three planes, the layout in which losses work on whole rows.
using ColorPlanes = std::array<Raster<float>, 3>;

/// What a photograph and the depth priors are compared with. w_i is the blending weight of
/// Gaussian i at the pixel, z_i the z-depth of its centre [internal units]. As the gradient of a
/// loss, each raster holds the derivative with respect to the value of that name, and an empty
/// raster stands for zeros.
struct TrainingBuffers {
  ColorPlanes color;    ///< Sum w_i c_i + (1 - alpha) * background
  Raster<float> alpha;  ///< Sum w_i
  /// Sum w_i z_i, not divided by alpha; empty unless TrainingRasterizerOptions::depth_sums.
  Raster<float> depth_sum;
  Raster<float> depth_square_sum;  ///< Sum w_i z_i^2; empty like depth_sum.
  /// Sum w_i^2; empty unless TrainingRasterizerOptions::weight_squares.
  Raster<float> weight_square_sum;
};

/// What the Gaussians of a set may be, and so which derivatives exist.
enum class GaussianShape {
  Balls,       ///< Three equal scales each; rotations do not matter.
  Ellipsoids,  ///< Anything.
};

/// How Gaussians are drawn and differentiated.
struct TrainingRasterizerOptions {
  Eigen::Vector3f background = Eigen::Vector3f::Zero();
  float dilation = kSplatDilation;  ///< Added to both image variances [pixels^2]; >= 0.
  float near_depth = 1e-3f;         ///< Centres nearer than this are culled [internal units]; > 0.
  GaussianShape shape = GaussianShape::Balls;
  bool sh_gradients = false;           ///< Fill GaussianGradients::sh.
  bool depth_sums = true;              ///< Draw the depth sums of TrainingBuffers.
  bool weight_squares = false;         ///< Draw TrainingBuffers::weight_square_sum.
  bool image_place_gradients = false;  ///< Fill GaussianGradients::image_place.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// The rasterizer of the trainer: draws a set of Gaussians into one camera by the rules of
/// rasterize(), and gives the derivatives of a loss on what it drew.
///
/// Memory is kept from one call to the next. Results are the same bits for any number of threads:
/// every tile writes one record per Gaussian it drew, and records are added in a fixed order.
/// The cuts (alpha below 1/255, finished pixels, alpha clamped at 0.99) are taken as constant, as
/// in 3DGS; the clamp of the slopes inside the projection has derivative zero where it is active.
///
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting", appendix A; Zwicker et al. 2001.
class TrainingRasterizer {
 public:
  explicit TrainingRasterizer(const TrainingRasterizerOptions& options);
  ~TrainingRasterizer();
  TrainingRasterizer(TrainingRasterizer&&) noexcept;
  TrainingRasterizer& operator=(TrainingRasterizer&&) noexcept;

  /// From the next forward() on. The memory stays.
  /// \throws InvalidInput as validate()
  void set_options(const TrainingRasterizerOptions& options);

  /// Draws. Both arguments must stay unchanged until backward() is done with them.
  /// \return owned by this object, valid until the next call
  /// \throws InvalidInput, LimitError as rasterize(); InvalidInput if a set promised as balls
  ///         holds something else.
  const TrainingBuffers& forward(const Gaussians& gaussians, const Camera& camera);

  /// Where the last forward() placed each Gaussian, and which it drew.
  const ProjectedGaussians& projected() const;

  /// Adds the derivatives of the loss to `sum`, whose arrays are created, filled with zero, if
  /// they are empty. Gaussians that were not drawn get nothing.
  ///
  /// \param loss  derivatives with respect to what the last forward() returned
  void backward(const TrainingBuffers& loss, GaussianGradients& sum);

 private:
  struct Tape;
  std::unique_ptr<Tape> tape_;
};

}  // namespace cgs
