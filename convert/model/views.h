// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "convert/model/model_pictures.h"
#include "libcgs/core/progress.h"

namespace cgs {

/// What to tell where a model has no priors, as splats of other programs: nothing is known of what
/// its input views saw, nor which views those were. Empty if it has.
std::string unknown_holes_warning(const Model& model);

/// What a view, an index into scene.views, is to its scene: "input", "held out" or "not used".
std::string view_role(const Scene& scene, int view);

/// The input views and those held out, ascending.
std::vector<int> views_with_photograph(const Scene& scene);

/// Shares of the pixels of a picture that are not masked.
struct HoleShares {
  double transparent = 0;
  double occluded = 0;
  double outside = 0;
  double estimated = 0;  ///< Shown, but by no evidence; no hole.
  double sky = 0;        ///< No hole.
  double masked = 0;     ///< Of all pixels.

  double hole() const { return transparent + occluded + outside; }
};

/// What a picture of a model shows.
struct RenderedPicture {
  std::string name;
  std::string role;                    ///< As view_role(); empty where no view is an input.
  std::optional<HoleShares> holes;     ///< Empty where nobody knows of holes.
  std::optional<double> painted = {};  ///< Share that shows Model::fill; empty without any.
};

/// Writes NAME.exr and NAME.{color,depth,normal,hole}.png for each of the given views of the model.
/// NAME.transient.png is the mask of what was left out of an input view because the others
/// contradict it, where there is any; NAME.restored.png its photograph without the water, where the
/// model states some. Without priors no hole.png is written; the EXR says, as it
/// does of any pixel, that no input view can vouch for it.
/// \param shown  of color.png alone: the EXR says what is drawn
std::vector<RenderedPicture> write_views(const Model& model,
                                         const std::vector<int>& views,
                                         const std::filesystem::path& folder,
                                         const Progress& progress,
                                         const PictureOptions& shown = {});

/// Writes frame_0000.png, frame_0000.hole.png and so on for cameras along a path, cameras.json that
/// says where they are, and contact.png: twelve of them, holes in magenta, in violet where
/// Model::fill shows. Without priors there are no masks and no magenta. What is returned has no
/// roles.
std::vector<RenderedPicture> write_path(const Model& model,
                                        const std::vector<Camera>& path,
                                        const std::filesystem::path& folder,
                                        const Progress& progress,
                                        const PictureOptions& shown = {});

/// Per view {"name", "role", "hole_fraction", …}, the role and the fraction null where they are
/// empty.
nlohmann::ordered_json views_to_json(const std::vector<RenderedPicture>& views);
/// Per frame {"name", "hole_fraction", …}.
nlohmann::ordered_json frames_to_json(const std::vector<RenderedPicture>& frames);

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
  bool through_water = false;  ///< Rendered through the water that the photographs show.
};

/// {"psnr", "ssim", "psnr_seen", "ssim_seen", "hole_fraction", "ms_ssim", "flip"}, null for what is
/// empty.
nlohmann::ordered_json figures_to_json(const ViewFigures& figures);
/// {"mean": {…}, "every_eighth": {…} or null, "views": [{"name", "role" as of views_to_json(), …,
/// "exposure"}]}, and "through_water": true where it is
nlohmann::ordered_json evaluation_to_json(const Evaluation& evaluation);

/// PSNR and SSIM of the rendered views against their photographs, over all pixels and over those
/// that are not holes, and MS-SSIM and FLIP over all. Pictures are those of write_views(), but for
/// what was painted (Model::fill), which no figure rests on. Loads the photographs.
///
/// Where the exposures of input views were matched, the photographs of others are matched to what
/// is rendered, by factors on red, green and blue light. Where water was taken out of them,
/// pictures are rendered through it: they are held against real photographs, never against what an
/// estimate makes of these.
///
/// Input views stay out of the mean where there are others. Warnings of the scene tell where there
/// are none, and where nothing is known of holes, whose figures are then empty.
/// \throws BadInput if none of the views has a photograph.
Evaluation evaluate_views(Model& model,
                          const std::vector<int>& views,
                          const Progress& progress,
                          HoleFill fill = HoleFill::Around);

}  // namespace cgs
