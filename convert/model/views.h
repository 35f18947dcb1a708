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

/// Whether a model says what its input views saw: without, every pixel would look like a hole.
inline bool knows_holes(const Model& model) { return !model.priors.empty(); }

/// What to tell where a model has no priors, as splats of other programs: nothing is known of what
/// its input views saw, nor which views those were. Empty if it has.
std::string unknown_holes_warning(const Model& model);

/// What a view, an index into scene.views, is to its scene: "input", "held out" or "not used".
std::string view_role(const Scene& scene, int view);

/// What a view was to a model, as view_role(); empty where no view is an input, as of splats of
/// other programs.
std::string role_of(const Scene& scene, int view);
/// null where it is empty
nlohmann::ordered_json role_to_json(const std::string& role);

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

/// Whether write_path() may write to a folder, before anything is drawn: a cameras.json there must
/// be of an earlier path.
/// \param wanted  file that the path is from, which must not be replaced; may be empty
/// \throws InvalidInput
void refuse_to_replace_path(const std::filesystem::path& folder,
                            const std::filesystem::path& wanted);

/// Writes frame_0000.png, frame_0000.hole.png and so on for cameras along a path, cameras.json that
/// says where they are, and contact.png: twelve of them, holes in magenta, in violet where
/// Model::fill shows, of which frame_0000.painted.png is the mask where the model has one. Without
/// priors there are no masks of holes and no magenta. What is returned has no roles.
/// \throws InvalidInput as refuse_to_replace_path()
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

}  // namespace cgs
