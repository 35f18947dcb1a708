// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "libcgs/coherence/parameter_block.h"
#include "libcgs/coherence/residual_maps.h"
#include "libcgs/coherence/view_dependence.h"
#include "libcgs/core/gaussian_gradients.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/pane.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// What gives residual depth and opacity: cubic B-spline lattices of each view and layer, or the
/// published convolutional networks, one for depth and one for opacity, shared by all views.
enum class ResidualDecoder { Lattice, Conv };

/// How the Gaussians of a view move together.
struct CoherenceOptions {
  ResidualDecoder decoder = ResidualDecoder::Lattice;
  std::vector<int> depth_spacing = {128, 64, 32, 16};  ///< Knots of the depth lattice [pixels].
  std::vector<int> opacity_spacing = {16, 4, 2};       ///< Knots of the opacity lattice [pixels].
  int conv_depth_width = 0;  ///< ConvDecoderOptions.width of depth; 0 = by the number of views, as
                             ///< published: 10 for two, 15 for three, 18 for more.
  int conv_opacity_width = 0;      ///< The same of opacity: 6, 10, 12.
  float conv_depth_gain = 2;       ///< Log depth per unit of the network's output; > 0.
  float conv_opacity_gain = 30;    ///< Logit per unit of the network's output; > 0.
  float max_depth_change = 0.5f;   ///< Bound of |log(depth / starting depth)|; > 0.
  float max_logit_change = 12.0f;  ///< Bound of the change of the opacity's logit; > 0.
  float radius_factor = 0.4f;      ///< As in InitialisationOptions.
  float min_radius = 0.15f;  ///< Of free shapes [pixels of the own view]; in (0, radius_factor].
                             ///< Gaussians that shrink open gaps, which other views show and the
                             ///< photographs do not.
  float max_radius = 3.0f;   ///< Of free shapes; >= radius_factor.
  float opacity = 0;         ///< As in InitialisationOptions.
  int sh_degree = 1;         ///< Highest degree of colours: 0, or 1 = where it pays, as
                             ///< add_view_dependence() judges.
  int layers_per_ray = 2;    ///< Most Gaussians on a ray: 1, or 2 = one more where find_pane()
                             ///< finds a pane.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// ConvDecoderOptions.width of the two networks.
struct ConvWidths {
  int depth;
  int opacity;
};
ConvWidths conv_widths(const CoherenceOptions& options, size_t views);

/// \throws InvalidInput if the networks of the options cannot decode the input views, which must be
///         of one size.
void require_decodable(const Scene& scene, const CoherenceOptions& options);

/// One Gaussian per input pixel, on the ray of its pixel, moved by few numbers.
///
/// For a pixel p of view n with starting depth z0(p):
///   z = z0 exp(D tanh(f_n(p) / D)),  logit(opacity) = logit(o0) + L tanh(g_n(p) / L),
/// with the residual maps f, g of CoherenceOptions::decoder and the bounds D, L. Both start at 0.
/// Until shapes are free, Gaussians are balls of radius_factor pixels. A free shape is an ellipse
/// of three numbers in its own picture, laid on the starting surface: with the steps P = [p_x p_y]
/// (3x2) from its point to the next pixels' points and a lower triangle L with e^a, e^b on its
/// diagonal, the covariance is P L L^T P^T + (min_radius pixels)^2 n n^T, with n normal to P. A
/// photograph cannot show how far a Gaussian reaches along the ray; this way, that follows the
/// surface instead of drifting. Seen from its own view, a Gaussian has the colour of its pixel;
/// where surfaces demand it, the colour changes with the direction. Free colours move only where
/// depth is measured: elsewhere, they would learn by heart what another view shows.
///
/// A pane in front of the scene is a second layer: one more Gaussian per pixel of the view it is
/// drawn from, after those of all views. They stay on its plane, and are wide enough that together
/// they are about as opaque in pictures of other sizes.
///
/// Labels are those of initial_gaussians(), wherever a Gaussian moves; a pane is estimated: its
/// place is what explains the pictures best, and no pixel measured it.
///
/// Source: Paliwal et al. 2024, "CoherentGS", section 3; the residual here is relative to depth
///         and bounded, and lattices may stand in for the convolutional decoders.
class CoherentGaussians {
 public:
  /// \param priors  in the order of scene.input; pixels of NaN depth have no Gaussian
  /// \param pane    if given, a pane in front of the scene, whose images are then Pane::behind
  /// \throws InvalidInput if priors, images and cameras are not of one size, or as
  ///         require_decodable()
  CoherentGaussians(const Scene& scene,
                    const std::vector<ViewPriors>& priors,
                    const CoherenceOptions& options,
                    const Pane* pane = nullptr);

  /// What the optimiser may change: blocks of depth (lattices have one per view, a network has one
  /// in all), blocks of opacity alike, and per view (a pane counts as one) a block of colour, the
  /// change of red, green and blue of each Gaussian, empty until free_colors(), and a block of
  /// shape, (a, b, corner of L) of each Gaussian, empty until free_shapes().
  std::vector<ParameterBlock> parameters;

  /// From now on every Gaussian has a shape of its own, at first L = radius_factor: it covers the
  /// piece of surface that its pixel shows and is, on a slope, longer than the ball was.
  void free_shapes();
  bool shapes_are_free() const { return shapes_are_free_; }

  /// From now on every Gaussian on measured surface has a colour of its own, at first its pixel's.
  void free_colors();

  /// Brings gaussians() and depth() up to date with the parameters.
  void decode();
  const Gaussians& gaussians() const { return gaussians_; }
  const ViewDependence& view_dependence() const { return view_dependence_; }
  size_t view_count() const { return views_.size(); }  ///< A pane counts as one.
  const DepthMap& depth(size_t view) const { return views_[view].depth; }
  /// Indices [first, last) of the Gaussians of one view, in row-major order of its pixels.
  struct Range {
    size_t first, last;
  };
  Range range(size_t view) const { return views_[view].range; }
  /// The pixel of a Gaussian of `view`, row-major; `index` counts from range(view).first.
  int pixel(size_t view, size_t index) const { return views_[view].pixels[index]; }

  /// Adds to the gradients of all parameters.
  ///
  /// \param gaussians  of the loss with respect to gaussians()
  /// \param depth      of the loss with respect to depth(), one raster per view; empty = zero
  void add_gradients(const GaussianGradients& gaussians, std::span<const Raster<float>> depth);

  /// Adds weight times the mean over Gaussians of the squared change of the logit of their opacity,
  /// and its gradient.
  /// \return weight times the mean
  double add_opacity_prior(double weight);

  /// The same for the squared change of colour, summed over its channels.
  double add_color_prior(double weight);

  /// Adds the bending energies of the lattices of depth and opacity, times weights; networks have
  /// none.
  /// \return the weighted sum
  double add_bending(double depth_weight, double opacity_weight);

 private:
  struct ViewState {
    Camera camera;
    DepthMap start;
    DepthMap depth;
    std::vector<int> pixels;
    std::vector<uint8_t> is_measured;               // per Gaussian
    std::vector<Eigen::Vector3f> start_color;       // constant coefficient of SH; if free
    std::vector<Eigen::Matrix<float, 3, 2>> steps;  // to the next pixels, for depth 1; if free
    Range range;
    float start_logit;
    float radius_factor;  // of balls [pixels]
    bool is_pane = false;
  };
  void add_pane(const Pane& pane, const Camera& camera);
  std::span<ParameterBlock> blocks(ParameterRole role);
  ParameterBlock& color(size_t n) { return parameters[parameters.size() - 2 * views_.size() + n]; }
  ParameterBlock& shape(size_t n) { return parameters[parameters.size() - views_.size() + n]; }
  void decode_view(size_t n);
  float add_shape_gradient(size_t n, size_t k, const CovarianceGradient& gradient);
  void add_view_gradients(size_t n,
                          const GaussianGradients& gaussians,
                          const Raster<float>& depth,
                          Raster<float>& by_f,
                          Raster<float>& by_g);
  std::vector<Raster<float>> zeros() const;  // of the size of the views

  CoherenceOptions options_;
  bool colors_are_free_ = false;
  bool shapes_are_free_ = false;
  std::vector<ViewState> views_;
  ResidualMaps depth_maps_;
  ResidualMaps opacity_maps_;
  std::vector<Raster<float>> depth_change_;  // f, then tanh(f / D), per view
  std::vector<Raster<float>> logit_change_;  // the same of g
  Gaussians gaussians_;
  ViewDependence view_dependence_;
};

}  // namespace cgs
