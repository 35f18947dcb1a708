// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "convert/model/model_pictures.h"
#include "libcgs/core/progress.h"

namespace cgs {

/// Whether the photograph of a view, an index into model.scene.views, is to be matched in exposure
/// to what is rendered: those of the input views were matched, and it is none of them.
bool is_exposed_otherwise(const Model& model, int view);

/// How well a rendered view agrees with its photograph. Each is empty where there is nothing to
/// compare, where a mask hides too much for it (MS-SSIM), or where nobody knows of holes.
struct ViewFigures {
  std::optional<double> psnr = {};  ///< [dB]
  std::optional<double> ssim = {};
  std::optional<double> psnr_seen = {};  ///< Over pixels that are no holes [dB].
  std::optional<double> ssim_seen = {};
  std::optional<double> hole_fraction = {};  ///< Of the pixels that are not masked.
  std::optional<double> ms_ssim = {};
  std::optional<double> flip = {};  ///< 0 = the same.
};

struct EvaluatedView {
  std::string name;
  std::string role;  ///< As view_role(); empty where no view is an input.
  ViewFigures figures;
  std::optional<Eigen::Vector3f> exposure;  ///< By which the photograph was matched, if it was.
};

struct Evaluation {
  ViewFigures mean;
  /// Of every eighth view from the first, which papers test LLFF scenes by (Mildenhall et al. 2020,
  /// "NeRF", 6.1); where the scene is one, and these were evaluated and no inputs.
  std::optional<ViewFigures> every_eighth;
  std::vector<EvaluatedView> views;
  bool through_water = false;         ///< Rendered through the water that the photographs show.
  std::vector<std::string> warnings;  ///< One line each.
};

/// {"psnr", "ssim", "psnr_seen", "ssim_seen", "hole_fraction", "ms_ssim", "flip"}, null for what is
/// empty.
nlohmann::ordered_json figures_to_json(const ViewFigures& figures);
/// {"mean": {…}, "every_eighth": {…} or null, "views": [{"name", "role" as of views_to_json(), …,
/// "exposure"}]}, and "through_water": true where it is
nlohmann::ordered_json evaluation_to_json(const Evaluation& evaluation);

/// PSNR and SSIM of the rendered views against their photographs, over all pixels and over those
/// that are not holes, and MS-SSIM and FLIP over all. Pictures are those of write_views(), but for
/// what was painted (Model::fill), which no figure rests on. Photographs are loaded one at a time.
///
/// Where the exposures of input views were matched, the photographs of others are matched to what
/// is rendered, by factors on red, green and blue light. Where water was taken out of them,
/// pictures are rendered through it: they are held against real photographs, never against what an
/// estimate makes of these.
///
/// Input views stay out of the mean where there are others. Warnings tell where there are none, and
/// where nothing is known of holes, whose figures are then empty.
/// \throws BadInput if none of the views has a photograph.
Evaluation evaluate_views(const Model& model,
                          const std::vector<int>& views,
                          const Progress& progress,
                          HoleFill fill = HoleFill::Around);

}  // namespace cgs
