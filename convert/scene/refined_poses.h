// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/text/terminal.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// What became of the camera of a view.
struct RefinedView {
  std::string view;
  bool is_input = true;     ///< Else it is held out.
  int matches = 0;          ///< With views that show the same.
  int points = 0;           ///< That come of them.
  bool is_refined = false;  ///< It moved.
  double degrees = 0;
  double distance = 0;  ///< [scene units]
  /// Median reprojection errors of the points [pixels]; empty where there are none.
  std::optional<double> error_before;
  std::optional<double> error_after;
};

struct Refinement {
  bool is_refined = false;  ///< A camera of an input view moved.
  std::vector<RefinedView> views;

  /// Of the input views, the worst; empty if none is known.
  std::optional<double> error_before() const;
  std::optional<double> error_after() const;
};

/// {"refined", "views": [{"view", "role", "matches", "points", "refined", "degrees", "distance",
/// "error_before", "error_after"}], "error_before", "error_after"}; null for what is empty
nlohmann::ordered_json refinement_to_json(const Refinement& refinement);
/// \throws nlohmann::json::exception
Refinement refinement_from_json(const nlohmann::ordered_json& json);

/// Cameras of a scene that were moved to where its photographs have them.
struct RefinedPoses {
  std::map<std::string, Eigen::Isometry3d> poses;  ///< world_from_cam of the views that moved.
  Refinement report;                               ///< In pixels of the photographs as worked on.
  Refinement fit;                                  ///< In pixels of the files.
  std::vector<std::string> warnings;               ///< What could not be told or placed, and why.
  std::string inputs;                              ///< Hashes of photographs and cameras, program.
  bool is_stored = false;                          ///< Read, not solved.
};

/// Refines the cameras of the input views as refine_poses(), and each held-out view against the
/// points these know; or reads what write_refined_poses() stored, if that was made from the same
/// and is whole.
///
/// \param scene   in world coordinates, with the identity frame
/// \param stored  folder; may be empty or not exist
/// \throws Error as read_photograph()
RefinedPoses refined_poses(const Scene& scene,
                           const std::filesystem::path& stored,
                           Terminal& terminal);

/// Moves the cameras of a scene.
void move_cameras(const RefinedPoses& refined, Scene& scene);

/// States the report in other units of length.
/// \param factor  of those per unit of the scene as read
void state_in_units(double factor, RefinedPoses& refined);

/// One line on it for people.
/// \param report  of RefinedPoses
std::string refinement_words(const Refinement& report);

/// Stores them as refined_poses.json in a folder, or removes what was stored there.
/// \throws IoError
void write_refined_poses(const std::filesystem::path& folder, const RefinedPoses& refined);
void forget_refined_poses(const std::filesystem::path& folder);

}  // namespace cgs
