// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "libcgs/coherence/coherent_gaussians.h"

namespace cgs {

/// What is trained: coherent Gaussians, one on the ray of each pixel (Trainer), or free ones that
/// nothing holds together (FreeSplats), the control that coherence is measured against.
enum class SplatMethod { Coherent, Classical };

/// How a model is trained. One step looks at all input views, of more than four at the next four.
/// Points in time are fractions of the whole schedule. Rates are per step: with lattices, a run of
/// more steps goes further, and is not the same run more slowly.
struct TrainingOptions {
  SplatMethod method =
      SplatMethod::Coherent;  ///< Classical takes a few fields, as FreeSplats says.
  CoherenceOptions coherence;

  int steps = 60;           ///< >= 0; 0 leaves the aligned initialisation.
  double coarse_until = 0;  ///< Until then images are halved; in [0, 1].
  double free_from = 0;     ///< From then on shapes are free; in [0, 1].
  double sharp_from = 1;    ///< From then on images are drawn at twice the size and averaged.

  double depth_rate = 1e-3;   ///< Of log depth, per step, at the start.
  double opacity_rate = 0.1;  ///< Of the logit.
  double color_rate = 3e-3;   ///< Of sRGB-coded colours in [0, 1]; 0 = colours stay.
  double shape_rate = 0.2;    ///< Of the entries of a shape (CoherentGaussians).
  double final_rate = 0.05;   ///< These rates fall to this part of themselves, along a cosine.

  /// Of the networks of decoder=conv, whose rates rise and fall by triangular2() (AdamW): those of
  /// depth and opacity at the first peak, and the share of the schedule until that of depth. That
  /// of opacity comes twice as late.
  double conv_depth_rate = 3e-4;
  double conv_opacity_rate = 1e-3;
  double conv_rise = 0.25;

  double l1_weight = 0.8;
  double ssim_weight = 0.2;
  double tv_weight = 0;         ///< Total variation of the rendered disparity.
  double masked_tv_weight = 0;  ///< The same within layers.
  double tv_to_layers = 0;      ///< Share of tv_weight that moves to the layers until the end.
  /// Distance of corresponding points, per internal unit, of which the scene is half to one wide
  /// (Frame). They correspond by the measured depth of the views, not by an optical flow: the term
  /// holds together what the plane sweep found, and tells nothing new.
  double flow_weight = 0;
  double prior_weight = 0.002;  ///< Departure of measured depths from their prior, in sigmas. With
                                ///< less, rounding decides where photographs hardly determine
                                ///< depth.
  /// Terms of related systems, each as the function of losses.h that its name begins with. All are
  /// off: docs/ablation.md has what each brings. Those of given depth do nothing without it.
  double spread_weight = 0;        ///< depth_spread(): depth along rays around what is measured.
  double emptiness_weight = 0;     ///< emptiness(): one Gaussian per ray.
  double near_opacity_weight = 0;  ///< near_opacity(), below 0.8 of the nearest measured depth.
  double edge_smooth_weight = 0;   ///< edge_smoothness() of depth that is not measured.
  double seen_through_weight = 0;  ///< seen_through() of Gaussians without measured depth.
  double order_weight = 0;         ///< depth_order() by given depth.
  double patch_depth_weight = 0;   ///< patch_depth() against given depth.
  double virtual_weight = 0;  ///< multi_scale_l1() on one scale, of a virtual_view() in each step.
  double virtual_tv_weight = 0;  ///< total_variation() of the same.
  double average_decay = 0;      ///< The model is the running mean of its parameters, of which a
                                 ///< step replaces 1 - this share; 0 = the last ones. In [0, 1).
  double depth_bending = 0;      ///< Of the depth lattice; 0 with decoder=conv, which has no knots.
  double opacity_bending = 0;
  double opacity_prior = 0.001;  ///< Squared change of the logit, mean over Gaussians.
  double color_prior = 0.6;      ///< The same of the colour, summed over its channels.

  int l1_levels = 5;
  double dropout = 0;      ///< Share of a view's own blocks left out of its picture; in [0, 1).
  int dropout_block = 32;  ///< Edge of a block [pixels].

  /// \throws InvalidInput naming the first field out of range, or that the method does not have
  void validate() const;
};

/// The settings of a name:
/// - "draft", "standard" and "fine": lattices, a third, all and twice the steps;
/// - "reference": the schedule that CoherentGS was published with, as far as it has a meaning here.
///   Networks; balls for 8/13 of the time, drawn at twice the size from 5/13 on; its losses but the
///   perceptual one; no prior that holds depth or opacity. A step here looks at all of three views,
///   so the 13 000 steps of one view each are 4333, with rates higher by the root of three. Where
///   paper and implementation differ, the paper: total variation goes over to layers from none to
///   all (as a mean over pairs within layers, not over all five), the flow term counts in full.
///   What remains of this program: correspondences of the flow term from measured depth where
///   theirs are from an optical flow, as a mean over the pixels of all pairs of neighbours; a
///   background of another colour in each step; drawing at twice the size along each axis; a change
///   of depth that is bounded by max_depth_change; steps and rates for three views, however many
///   there are.
/// - "classical": 3D Gaussian Splatting as published in 2023, without coherence, a tenth of its
/// steps
///   of one view each (FreeSplats).
///
/// \throws InvalidInput for another name
TrainingOptions training_preset(std::string_view name);

/// Sets one field by its name, e.g. ("steps", "500") or ("depth_spacing", "64,16"); the names are
/// those of TrainingOptions and CoherenceOptions.
/// \throws InvalidInput if there is no such field or the value is not of its type.
void set_training_field(TrainingOptions& options, std::string_view name, std::string_view value);

/// All fields, in the order above, with their values as set_training_field() takes them.
std::vector<std::pair<std::string, std::string>> training_fields(const TrainingOptions& options);

}  // namespace cgs
