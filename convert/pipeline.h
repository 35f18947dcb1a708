// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/control_frame.h"
#include "convert/known_distances.h"
#include "convert/memory_plan.h"
#include "convert/model.h"
#include "convert/photo_poses.h"
#include "convert/terminal.h"
#include "io/scene_reader.h"
#include "libcgs/train/training_options.h"
#include "meshing/tsdf.h"

namespace cgs {

/// A scene as the user names it.
struct SceneRequest {
  std::filesystem::path path;
  SceneOptions options;
  std::string
      assume_unit;  ///< Unit of one scene unit where the scene does not say; empty = unknown.
  std::vector<double> up;  ///< World direction that is up; empty = judged by the cameras.
  double focal = 0;        ///< Of photographs without cameras [pixels]; 0 = not given.
  std::vector<DistanceWords> known_distances;  ///< Where they are given, no assume_unit.
  std::string marker_size;  ///< Side of printed markers; where it is given, no assume_unit.
  ControlRequest control;   ///< Where it is given, nothing else of scale, unit and up.
};

/// What `cgs run` is asked for; lengths are as the user typed them, with or without a unit.
struct RunRequest {
  SceneRequest scene;
  std::filesystem::path output;
  TrainingOptions training;
  std::string voxel_size;         ///< Empty = from the pixel footprint.
  std::string simplify;           ///< Largest error of simplification; empty = default, "0" = none.
  std::string compression_error;  ///< Of the compressed mesh; empty = 1/16384 of its size.
  std::string max_error;          ///< Promise: how far the written meshes lie from the fused
                                  ///< surface at most; empty = none.
  size_t max_size = 0;            ///< Promise: largest asset.glb [bytes]; 0 = any.
  size_t memory_limit = 0;        ///< [bytes]; 0 = 80 % of what is free.
  bool overwrite = false;
  std::string settings_reason;  ///< Why size and training are these, for the report; may be empty.
};

/// Where solved cameras lie, below the folder of the model.
inline constexpr const char* kPosesFolder = "colmap";

/// Reads a scene, solving for the cameras of a folder that holds nothing but photographs, and gives
/// it the unit the user assumes, or moves it into the frame of control points, if any.
///
/// \param model  folder of the model the scene is for; cameras stored there by OpenedScene::keep()
///               are taken where they were solved from the same. Empty = none.
/// \throws InvalidInput where a focal length is given for a scene with cameras, or two options
///         state the scale; as read_scene(), photo_poses() and move_to_control_frame()
struct OpenedScene {
  Scene scene;
  std::optional<PhotoPoses> poses;  ///< If they were solved for.
  nlohmann::ordered_json control;   ///< As move_to_control_frame() returns it; null without.

  /// Stores solved cameras below the folder of the model, for other programs and for the next time.
  void keep(const std::filesystem::path& model) const;
};
OpenedScene open_scene(const SceneRequest& request,
                       const std::filesystem::path& model,
                       Terminal& terminal);

/// What printed markers tell about the scale; empty where the user states no size of theirs.
/// \throws InvalidInput as marker_bars()
std::vector<MarkerBar> scale_markers(const SceneRequest& request, const Scene& scene);

/// Photographs to every asset, in stages that are skipped when their output is there already.
/// \return the content of OUT/report.json.
nlohmann::ordered_json run_pipeline(const RunRequest& request, Terminal& terminal);

/// Everything that decides the result of a request: arguments, and hashes of what goes in.
nlohmann::ordered_json request_json(const RunRequest& request, const Scene& scene);

/// The input views and those held out, ascending.
std::vector<int> views_with_photograph(const Scene& scene);

/// Fuses what the input views of a model see. `voxel_size` as in RunRequest; `coarsest_voxel` as in
/// TsdfOptions.
FusedVolume fuse_model(const Model& model,
                       const std::string& voxel_size,
                       size_t memory_limit,
                       const Progress& progress,
                       double coarsest_voxel = 0);

/// The figures of a fusion for a report, in file units.
nlohmann::ordered_json fusion_to_json(const TsdfReport& report, const Frame& frame);

/// What the promises of a request make a run hold against the fused surface.
MeasuredFiles measured_files(const RunRequest& request);

/// Memory the program may plan for: the user's limit, or 80 % of what is free now [bytes].
size_t memory_budget(size_t limit);

}  // namespace cgs
