// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/reconstruct.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <utility>

#include "libcgs/coherence/coherent_gaussians.h"
#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"
#include "libcgs/core/exposure.h"
#include "libcgs/core/remedy.h"
#include "libcgs/priors/exposure.h"
#include "libcgs/priors/finest_view.h"
#include "libcgs/priors/grey_photographs.h"
#include "libcgs/priors/measured_range.h"
#include "libcgs/priors/scratches.h"
#include "libcgs/priors/transients.h"
#include "libcgs/reconstruct/evidence_words.h"
#include "libcgs/render/support.h"

namespace cgs {

namespace {

// What would else show only after minutes.
void require_possible(const Scene& scene, const ReconstructionOptions& options) {
  options.priors.validate();
  options.training.validate();
  if (options.medium == Medium::Water && scene.has_old_photographs) {
    throw InvalidInput("old photographs are not looked at through water: leave one of the two out");
  }
  if (scene.input.size() > kMostInputs) {
    throw WithRemedy<InvalidInput>(Remedy::ChosenViews,
                                   std::to_string(scene.input.size()) +
                                       " input views, of which at most " +
                                       std::to_string(kMostInputs) +
                                       " can be reconstructed together: use fewer, or cut the "
                                       "scene into groups with cgs split");
  }
  if (options.training.method == SplatMethod::Coherent) {
    require_decodable(scene, options.training.coherence);
  }
}

void load_photographs(Scene& scene, const ReconstructionHooks& hooks, const Progress& progress) {
  if (hooks.load_photographs) hooks.load_photographs(scene, progress);
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.image.empty()) {
      throw InvalidInput("the photograph of view " + view.name + " is not loaded");
    }
  }
}

// Splats keep the colours of the photographs they stem from: where exposures differ, the same
// surface would come in two colours, and every step of the training would fight over them.
// Returns ExposureGains::difference().
float match_exposures(Scene& scene, const ExposureGains& exposure) {
  for (size_t k = 0; k < scene.input.size(); ++k) {
    View& view = scene.views[static_cast<size_t>(scene.input[k])];
    view.exposure = exposure.gain[k];
    apply_exposure(view);
  }
  return exposure.difference();
}

// Corrects photographs by what they have in common, as PhotoResponses says.
PhotoResponses match_responses(Scene& scene, const std::vector<ViewPriors>& priors) {
  PhotoResponses out = fit_photo_responses(scene, priors);
  out.is_applied = out.is_richer() || has_grey_photographs(scene);
  if (!out.is_applied) return out;
  for (size_t k = 0; k < scene.input.size(); ++k) {
    View& view = scene.views[static_cast<size_t>(scene.input[k])];
    view.response = out.response[k];
    view.exposure = out.gain[k];
    apply_exposure(view);
  }
  return out;
}

std::vector<double> mended_shares(Scene& scene, const std::vector<ViewPriors>& priors) {
  std::vector<double> out;
  for (const MaskMap& mask : mend_scratches(scene, priors)) {
    const auto mended = std::count(mask.data.begin(), mask.data.end(), 1);
    out.push_back(static_cast<double>(mended) / static_cast<double>(mask.data.size()));
  }
  return out;
}

// Brings the photographs to one response, as far as they need it. Where that does more than gains
// do, the priors are estimated again: what moved, for one, is told by colours.
void match_photographs(const ReconstructionOptions& options,
                       EstimatedPriors& priors,
                       Scene& scene,
                       TrainedModel& out,
                       const Progress& progress) {
  if (scene.has_old_photographs || has_grey_photographs(scene)) {
    out.responses = match_responses(scene, priors.views);
  }
  if (!out.responses.is_applied) {
    out.exposure_difference = match_exposures(scene, exposure_gains(scene, priors.views));
  }
  if (scene.has_old_photographs) out.mended = mended_shares(scene, priors.views);
  const bool is_mended =
      std::any_of(out.mended.begin(), out.mended.end(), [](double share) { return share > 0; });
  if (out.responses.is_applied || is_mended) {
    priors = estimate_priors(scene, options.priors, progress);
  }
}

// Gives grey photographs the colours that others tell.
std::vector<GreyReport> color_grey(Scene& scene, const std::vector<ViewPriors>& priors) {
  std::vector<GreyReport> out;
  const std::vector<MaskMap> unknown = color_grey_photographs(scene, priors);
  for (size_t k = 0; k < unknown.size(); ++k) {
    if (unknown[k].empty()) continue;
    const auto& depth = priors[k].depth.data;
    const auto surface = std::count_if(depth.begin(), depth.end(), has_gaussian);
    const auto without = std::count(unknown[k].data.begin(), unknown[k].data.end(), 1);
    out.push_back({scene.views[static_cast<size_t>(scene.input[k])].name,
                   surface > 0 ? double(without) / double(surface) : 0});
  }
  return out;
}

// What moved is no picture of the scene: nothing is to be made to look like it.
void leave_out_other_than_scene(const std::vector<ViewPriors>& priors, Scene& scene) {
  for (size_t k = 0; k < scene.input.size(); ++k) {
    View& view = scene.views[static_cast<size_t>(scene.input[k])];
    mask_other_than_scene(priors[k], view);
  }
}

PaneReport report_of(const Pane& pane, const Scene& scene) {
  const auto pixels = static_cast<double>(pane.depth.data.size());
  const auto covered = std::count_if(pane.depth.data.begin(), pane.depth.data.end(), has_gaussian);
  return {scene.views[static_cast<size_t>(scene.input[pane.drawn_from])].name,
          static_cast<double>(covered) / pixels,
          double{pane.opacity},
          pane.gain};
}

// A pane in the photographs, and then the priors of what lies behind it: what it shows disturbs
// their matching, and the better they are, the better the two are told apart.
std::optional<Pane> look_behind_pane(const Scene& scene,
                                     const ReconstructionOptions& options,
                                     EstimatedPriors& priors,
                                     const Progress& progress) {
  if (options.training.coherence.layers_per_ray < 2) return std::nullopt;  // none to draw it by
  std::optional<Pane> pane = find_pane(scene, priors.views, part_of(progress, 0, 0.1));
  if (!pane) return pane;
  priors = estimate_priors(behind_pane(scene, *pane), options.priors, part_of(progress, 0.1, 0.9));
  std::optional<Pane> better = find_pane(scene, priors.views, part_of(progress, 0.9, 1));
  return better ? better : pane;
}

// The water before the surface, taken out of the photographs, and then the priors of what these
// show: far places get back the contrast by which they are matched, and the better they are
// matched, the better the water is known. Exposures are compared without it, as it dims what is
// farther away; photographs are matched before it is taken out, as load_images() does.
void look_through_water(const PriorsOptions& options,
                        EstimatedPriors& priors,
                        TrainedModel& out,
                        Scene& scene,
                        const Progress& progress) {
  const WaterEstimate first = estimate_water(scene, priors.views);
  out.water = first;
  if (!first.water) return;
  const auto cleared = [&](const Water& water) {
    Scene clear = scene;
    clear.water = water;
    take_out_water(priors.views, clear);
    return clear;
  };
  out.exposure_difference =
      match_exposures(scene, exposure_gains(cleared(*first.water), priors.views));
  priors = estimate_priors(cleared(*first.water), options, progress);
  out.water = estimate_water(scene, priors.views);
  // Where there is hardly any, it may be found once and not again: one of the two has to be taken.
  if (!out.water->water) out.water->water = first.water;
  scene = cleared(*out.water->water);
}

// Views whose depth rests on little.
void warn_of_little_depth(const std::vector<PriorsCoverage>& coverage, Scene& scene) {
  constexpr double kLittle = 0.1;
  for (size_t i = 0; i < coverage.size(); ++i) {
    const View& view = scene.views[static_cast<size_t>(scene.input[i])];
    const double share = coverage[i].measured + coverage[i].guessed;
    if (share >= kLittle) continue;
    std::array<char, 120> text{};
    std::snprintf(text.data(), text.size(), "depth was found for %.1f %% of view ", 100 * share);
    scene.warnings.push_back(
        text.data() + view.name +
        (is_measured(coverage[i])
             ? "; what is filled in from there is an estimate: see that views overlap and show "
               "texture"
             : ", so it adds nothing: hardly a point of it is seen in another input view"));
  }
}

// What the priors tell of the scene itself.
void take_findings(const PriorsReport& found, Scene& scene) {
  const std::vector<std::string>& remarks = found.given.remarks;
  scene.warnings.insert(scene.warnings.end(), remarks.begin(), remarks.end());
  take_sensor_scale(found.given, scene.frame);
  warn_of_little_depth(found.coverage, scene);
}

void train_coherent(const Pane* pane,
                    const ReconstructionOptions& options,
                    const Progress& progress,
                    TrainedModel& out) {
  const ReconstructionHooks& hooks = options.hooks;
  // Its constructor places one Gaussian on the ray of each pixel.
  Trainer trainer(out.model.scene, out.model.priors, options.training, pane);
  if (hooks.begin_training) hooks.begin_training(out.model, pane, trainer);
  while (!trainer.done()) {
    trainer.step();
    try {
      report(progress, double(trainer.steps_done()) / options.training.steps);
    } catch (const Cancelled&) {
      if (hooks.on_cancel) hooks.on_cancel(trainer);
      throw;
    }
    if (hooks.after_step) hooks.after_step(trainer);
  }
  if (hooks.after_training) hooks.after_training(trainer);
  out.model.gaussians = trainer.model().gaussians();
  out.view_dependence = trainer.model().view_dependence();
  out.steps = trainer.history();
}

void train_classical(const ReconstructionOptions& options,
                     const Progress& progress,
                     TrainedModel& out) {
  const Scene& scene = out.model.scene;
  std::optional<Gaussians> start;
  if (options.hooks.load_splats) start = options.hooks.load_splats(scene.frame);
  FreeSplats splats(scene, out.model.priors, options.training, std::move(start));
  while (!splats.done()) {
    splats.step();
    report(progress, double(splats.steps_done()) / options.training.steps);
  }
  out.model.gaussians = splats.gaussians();
  out.density = splats.density();
  out.steps = splats.history();
}

}  // namespace

TrainedModel reconstruct(Scene scene,
                         const ReconstructionOptions& options,
                         const Progress& progress) {
  const ReconstructionHooks& hooks = options.hooks;
  TrainedModel out;
  require_possible(scene, options);
  load_photographs(scene, hooks, part_of(progress, 0, 0.01));
  to_canonical(scene);
  narrow_depth_ranges(scene, options.priors.sweep, part_of(progress, 0.01, 0.02));
  mark_grey_photographs(scene);
  const bool may_go_twice =
      options.medium != Medium::None || scene.has_old_photographs || has_grey_photographs(scene);
  const double first = may_go_twice ? 0.1 : 0.18;
  EstimatedPriors priors = estimate_priors(scene, options.priors, part_of(progress, 0.02, first));
  const Progress again = part_of(progress, first, 0.18);
  if (options.medium == Medium::Water)
    look_through_water(options.priors, priors, out, scene, again);
  std::optional<Pane> pane;
  if (!scene.water) {
    match_photographs(options, priors, scene, out, again);
    out.grey = color_grey(scene, priors.views);
    // There hardly ever is one, and without one this is quick.
    pane = look_behind_pane(scene, options, priors, part_of(progress, 0.18, 0.2));
  }
  const Pane* const drawn_before = pane ? &*pane : nullptr;
  leave_out_other_than_scene(priors.views, scene);
  mark_shown_finer(scene, priors.views);
  if (pane) out.pane = report_of(*pane, scene);
  take_findings(priors.report, scene);
  out.priors = std::move(priors.report);
  out.model.priors = std::move(priors.views);
  out.model.scene = std::move(scene);
  if (hooks.inspect) hooks.inspect(out.model, out.priors);
  const Progress training = part_of(progress, 0.2, 1);
  if (options.training.method == SplatMethod::Classical) {
    train_classical(options, training, out);
  } else {
    train_coherent(drawn_before, options, training, out);
  }
  // The depth of the priors stays that of the sweep: meshes and support rest on what was measured,
  // pictures on what was optimised to look right.
  out.model.evidence = description_of(out, options.training);
  report(progress, 1);
  return out;
}

void take_sensor_scale(const GivenDepthReport& given, Frame& frame) {
  if (frame.has_metric_scale() || !(given.metres_per_unit > 0)) return;
  frame.metres_per_unit = given.metres_per_unit;
  frame.metres_sigma = given.metres_sigma;
  frame.scale_source = ScaleSource::DepthSensor;
}

}  // namespace cgs
