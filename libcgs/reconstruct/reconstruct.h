// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/priors/pane.h"
#include "libcgs/priors/photo_response.h"
#include "libcgs/priors/water.h"
#include "libcgs/reconstruct/model.h"
#include "libcgs/train/free_splats.h"
#include "libcgs/train/trainer.h"

namespace cgs {

/// What a caller may do on the way; each may be empty. What they throw ends the work.
struct ReconstructionHooks {
  /// Fills View::image, valid and given_depth of the input views, in place of having them.
  std::function<void(Scene&, const Progress&)> load_photographs = {};
  /// Of method=classical: gives the splats to begin from, in the frame of the scene, in place of
  /// measured_points().
  std::function<Gaussians(const Frame&)> load_splats = {};
  /// Sees the cameras and what was measured, before the training, which takes much longer.
  std::function<void(const Model&, const PriorsReport&)> inspect = {};
  // The next four are told of coherent Gaussians alone.
  /// Before the first step: may Trainer::restore() what a trainer of the same model and pane saved.
  std::function<void(const Model&, const Pane*, Trainer&)> begin_training = {};
  std::function<void(const Trainer&)> after_step = {};
  std::function<void(const Trainer&)> after_training = {};  ///< Also where there was no step.
  /// The progress function threw Cancelled, which goes on once this returns.
  std::function<void(const Trainer&)> on_cancel = {};
};

struct ReconstructionOptions {
  PriorsOptions priors;
  TrainingOptions training;
  ReconstructionHooks hooks = {};
  /// What lies before the surface, which is to be taken out of the photographs.
  Medium medium = Medium::None;
};

/// What became of a pane in the photographs.
struct PaneReport {
  std::string view;    ///< The one it is drawn from; empty = there is none.
  double share = 0;    ///< Of the pixels of that view.
  double opacity = 0;  ///< Before the training.
  double gain = 0;     ///< Pane::gain [dB]
};

/// What became of a photograph without colours among others with some.
struct GreyReport {
  std::string view;
  double share_without_color = 0;  ///< Of its pixels of surface: no photograph tells their colour.
};

/// A model, and how it was come by.
struct TrainedModel {
  Model model;
  PriorsReport priors;
  float exposure_difference = 0;  ///< ExposureGains::difference() of the input views
  PhotoResponses responses;       ///< Empty where gains were all that was looked for.
  std::vector<GreyReport> grey;
  std::vector<double> mended;  ///< Of old photographs, the shares that mend_scratches() changed.
  ViewDependence view_dependence;
  PaneReport pane;
  std::optional<WaterEstimate> water;         ///< Where it was looked for.
  std::vector<StepReport> steps;              ///< Of the training; empty = aligned initialisation.
  std::optional<DensityReport> density = {};  ///< Of method=classical.
};

/// The method from photographs with cameras to Gaussians: canonical frame, depth priors, exposures,
/// a pane, one Gaussian on the ray of each pixel, training. Where the photographs show a pane,
/// depth is estimated once more from what lies behind it. Where they were taken through water, that
/// is estimated from what was measured, taken out of the photographs, and depth estimated once more
/// from these; Scene::water says what was taken out, and no pane is looked for. Where
/// Scene::has_old_photographs, or one is grey among others with colours, their responses are
/// fitted; where that tells more than gains, depth is estimated once more from corrected
/// photographs. Of grey ones, the luminance is compared. With method=classical the priors are the
/// same, and free Gaussians are trained. Same scene and options, same bits, for any number of
/// threads.
///
/// \param scene  in world coordinates with the identity frame; Scene::input are the views to
///               reconstruct from, two or more. Their photographs are loaded, sRGB-coded in [0, 1]
///               and of the size of their cameras, or hooks.load_photographs loads them.
/// \return the model in its canonical frame [internal units], with metres per unit where
///         depth of a sensor tells them; what is odd of the photographs is in Scene::warnings
/// \throws InvalidInput for an option out of range, too few pixels for the decoder, photographs
///         that are not loaded; and as to_canonical(), estimate_priors(), fit_water() and the
///         Trainer
/// Source: Paliwal et al. 2024, "CoherentGS", section 3, with depth of a plane sweep.
TrainedModel reconstruct(Scene scene,
                         const ReconstructionOptions& options,
                         const Progress& progress = {});

/// Gives a frame without scale the one that metric depth of the photographs tells, if it does.
void take_sensor_scale(const GivenDepthReport& given, Frame& frame);

}  // namespace cgs
