// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "convert/text/terminal.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/colmap_model.h"

namespace cgs {

/// Cameras of a folder of photographs, and what they were solved from.
struct PhotoPoses {
  ColmapModel model;
  std::string inputs;                 ///< Names and hashes of the photographs, options, program.
  std::vector<std::string> warnings;  ///< Who is left out; whose Exif is refuted.
  std::vector<std::string> notes;     ///< How the focal length was found.
  double focal_sigma = 0;             ///< Largest of SolvedPhoto::focal_sigma.
  bool tried_from_aside = false;      ///< Features as seen from aside were looked for, too.
  bool is_stored = false;  ///< Read, not solved; the places of features are then not known.
};

/// What is known of photographs beforehand.
struct PhotoPoseOptions {
  double focal = 0;        ///< [pixels] of every photograph as stored; 0 = from Exif, else solved.
  bool each_lens = false;  ///< Every photograph has a focal length and a distortion of its own;
                           ///< else those of one camera, size and marked focal length share them.
  bool may_have_border = false;  ///< As View::may_have_border.
  bool all_views = false;        ///< As SceneOptions::all_views.
};

/// Solves for the cameras of the photographs in a folder, or reads what write_photo_poses() stored
/// in `stored` if that was solved from the same.
///
/// \param names   file names of those to reconstruct from; if empty, as many as
///                SceneOptions::wanted_views(). If there are too many photographs to compare, only
///                these are used. The others are placed where that is easy: features as seen from
///                aside, which take minutes, are looked for on account of wanted ones alone.
/// \param stored  may be empty or not exist
/// \throws BadInput Empty (fewer than two photographs), and as read_image(); LimitError for more
///         photographs than can be compared in reasonable time; NumericalError as solve_poses()
PhotoPoses photo_poses(const SceneRoot& root,
                       const std::vector<std::string>& names,
                       const PhotoPoseOptions& how,
                       const std::filesystem::path& stored,
                       Terminal& terminal);

/// Stores them as a COLMAP model in sparse/0 below the folder, with poses.json beside it.
/// The other removes what was stored there.
/// \throws IoError
void write_photo_poses(const std::filesystem::path& folder, const PhotoPoses& poses);
void forget_photo_poses(const std::filesystem::path& folder);

}  // namespace cgs
