// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/scene/camera_fit.h"
#include "convert/scene/control_frame.h"
#include "convert/scene/known_distances.h"
#include "convert/scene/photo_poses.h"
#include "convert/scene/refined_poses.h"
#include "convert/text/terminal.h"
#include "io/scenes/scene_reader.h"

namespace cgs {

/// A scene as the user names it.
struct SceneRequest {
  std::filesystem::path path;
  SceneOptions options;
  /// Unit of one scene unit where the scene does not say; empty = unknown.
  std::string assume_unit;
  std::vector<double> up;  ///< World direction that is up; empty = judged by the cameras.
  double focal = 0;        ///< Of photographs without cameras [pixels]; 0 = not given.
  bool each_lens = false;  ///< Photographs without cameras share no focal length by their Exif.
  bool old_photographs = false;  ///< Of prints and films: borders, and responses of their own.
  /// Move the cameras a scene states to where the photographs have them.
  bool refine_poses = false;
  std::vector<DistanceWords> known_distances;  ///< Exclude assume_unit.
  std::string marker_size;                     ///< Side of printed markers; excludes assume_unit.
  ControlRequest control;                      ///< Excludes all else on scale, unit and up.

  /// Whether lengths seen in the photographs tell the scale.
  bool states_lengths() const;
};

/// Where solved cameras lie, below the folder of the model.
inline constexpr const char* kPosesFolder = "colmap";

/// What open_scene() returns.
struct OpenedScene {
  Scene scene;
  std::optional<PhotoPoses> poses;       ///< If they were solved for.
  std::optional<RefinedPoses> refined;   ///< If that was asked for.
  std::optional<ControlReport> control;  ///< If control points were given.

  /// Relative standard deviation of focal lengths that were solved for; 0 = they were given.
  double focal_sigma() const { return poses ? poses->focal_sigma : 0; }

  /// Stores solved and refined cameras below the folder of the model, for other programs and for
  /// the next time, and takes away those of an earlier scene.
  void keep(const std::filesystem::path& model) const;
};

/// What to do with cameras that took minutes, before anything that may be refused.
using Solved = std::function<void(const OpenedScene&)>;

/// Reads a scene, solving for the cameras of a folder that holds nothing but photographs or
/// refining those it states as asked, and gives it the unit the user assumes, or moves it into the
/// frame of control points, if any.
///
/// \param model  folder of the model the scene is for; cameras stored there by OpenedScene::keep()
///               are taken where they were solved from the same. Empty = none.
/// \param solved called once cameras were solved for or refined, and not read; the scene may not be
///               there yet, but OpenedScene::keep() works. May be empty.
/// \throws InvalidInput where a focal length is given for a scene with cameras, refinement is asked
///         for where there are none, or two options state the scale; as read_scene(),
///         photo_poses(), refined_poses() and move_to_control_frame()
OpenedScene open_scene(const SceneRequest& request,
                       const std::filesystem::path& model,
                       Terminal& terminal,
                       const Solved& solved = {});

/// Whether open_scene() may take minutes, to solve for cameras or to refine them.
bool needs_cameras(const SceneRequest& request);

/// How well cameras that were taken as the scene states them fit the photographs, as camera_fit();
/// empty for others. What is wrong with them is added to the warnings of the scene.
std::optional<CameraFit> check_stated_cameras(OpenedScene& opened, Terminal& terminal);

}  // namespace cgs
