// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/text/terminal.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// Cameras of a scene that were moved to where its photographs have them.
struct RefinedPoses {  // NOLINT(bugprone-exception-escape): moving JSON does not throw
  std::map<std::string, Eigen::Isometry3d> poses;  ///< world_from_cam of the views that moved.
  /// {"refined": whether any camera of an input view moved, "views": [{"view", "role", "matches":
  ///  with views that show the same, "points": that come of them, "refined", "degrees", "distance"
  ///  [scene units], "error_before", "error_after"}], "error_before", "error_after": median
  ///  distances between where points appear and where they were seen, worst input view [pixels of
  ///  the photographs as worked on]}; errors are null where no points tell
  nlohmann::ordered_json report;
  nlohmann::ordered_json fit;         ///< "refined" and "views" in pixels of the files.
  std::vector<std::string> warnings;  ///< What could not be told or placed, and why.
  std::string inputs;                 ///< Hashes of photographs and cameras, program.
  bool is_stored = false;             ///< Read, not solved.
};

/// Refines the cameras of the input views as refine_poses(), and each held-out view against the
/// points these know; or reads what write_refined_poses() stored, if that was made from the same
/// and is whole.
///
/// \param scene   in world coordinates, with the identity frame
/// \param stored  folder; may be empty or not exist
/// \throws as read_photograph()
RefinedPoses refined_poses(const Scene& scene,
                           const std::filesystem::path& stored,
                           Terminal& terminal);

/// Moves the cameras of a scene.
void move_cameras(const RefinedPoses& refined, Scene& scene);

/// States the report in other units of length. \param factor  of those per unit of the scene as
/// read
void state_in_units(double factor, RefinedPoses& refined);

/// One line on it for people. \param report  of RefinedPoses
std::string refinement_words(const nlohmann::ordered_json& report);

/// Stores them as refined_poses.json in a folder, or removes what was stored there.
/// \throws IoError
void write_refined_poses(const std::filesystem::path& folder, const RefinedPoses& refined);
void forget_refined_poses(const std::filesystem::path& folder);

}  // namespace cgs
