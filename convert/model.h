// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/render/render_buffers.h"
#include "libcgs/render/support.h"
#include "libcgs/train/trainer.h"

namespace cgs {

/// A reconstruction: cameras, Gaussians, and what the input views know about depth. This is what
/// the folder OUT/model holds.
struct Model {
  Scene scene;  ///< In its canonical frame; pixels only where loaded.
  Gaussians gaussians;
  std::vector<ViewPriors> priors;  ///< In the order of scene.input; empty for foreign splats.
};

/// What to do with the photographs.
struct ModelRequest {
  PriorsOptions priors;
  TrainingOptions training;
  /// Where checkpoints of the training go; empty = none. They stay until forget_checkpoints().
  std::filesystem::path checkpoints;
  /// A network that guesses the depth of the photographs, as depth_network.h; empty = none.
  std::filesystem::path depth_network;
  bool keeps_others = false;  ///< Checkpoints of other work are not replaced.
  /// Sees the cameras and what was measured, before the training, which takes much longer: what it
  /// throws ends the work.
  std::function<void(const Model&)> inspect = {};
};

/// Scene -> model. Loads the images of the input views, moves the scene to its canonical frame,
/// estimates depth and optimises the Gaussians; goes on from a checkpoint of the same work.
/// If the progress function throws Cancelled, the training so far is saved first.
/// \throws BadInput Mismatch for a checkpoint of other work that is to be kept
struct TrainedModel {
  Model model;
  PriorsReport priors;
  std::vector<StepReport> steps;  ///< Of the training; empty = aligned initialisation.
  /// Checkpoints that could not be read or written, for the terminal: they change no result.
  std::vector<std::string> hitches;
};
TrainedModel train_model(Scene scene, const ModelRequest& request, const Progress& progress);

/// Gives a frame without scale the one that metric depth of the photographs tells, if it does.
void take_sensor_scale(const GivenDepthReport& given, Frame& frame);

/// True if a training began in that folder and did not end.
bool has_checkpoints(const std::filesystem::path& folder);

/// Removes the checkpoints of finished work. \throws IoError
void forget_checkpoints(const std::filesystem::path& folder);

/// Every field of the options and its value, as set_training_field() takes them.
nlohmann::ordered_json settings_to_json(const TrainingOptions& options);

/// What was done, for run.json, the report and OUT/model/training.json: a description in plain
/// words, the effective settings, and the loss over the steps.
nlohmann::ordered_json training_to_json(const TrainedModel& trained, const ModelRequest& request);

/// Writes gaussians.ply, cameras.json and priors/<view>.exr. \throws IoError
void write_model(const std::filesystem::path& folder, const Model& model);

/// Reads what write_model() wrote, or gaussians.ply and cameras.json of 3DGS, which state no frame:
/// it is then the canonical one of the splats. Of the folder of a run, the model in it.
///
/// Where cameras were solved from photographs alone and something measured tells their scale, the
/// frame is in metres: nobody else knows the unit of these cameras.
/// \throws BadInput
Model read_model(const std::filesystem::path& folder);

/// The same in the unit of its cameras, whatever that is: to give it a scale, and to write it.
Model read_model_as_written(const std::filesystem::path& folder);

/// What read_model() does to what read_model_as_written() gives.
void use_metres_where_measured(Scene& scene);

/// Finds the photographs of a model anew in a scene folder, by the names of the views, for a model
/// or photographs that were moved. \throws BadInput as read_scene()
void relink_images(Scene& scene, const std::filesystem::path& folder);

/// 1 where no other view confirms the depth of a view: a guess from that view alone, or filled in
/// from neighbours; empty if it is nowhere.
MaskMap guessed_pixels(const ViewPriors& priors);

/// The input views with their depth and its uncertainty: who can vouch for a rendered pixel.
std::vector<SupportView> support_views(const Model& model);

/// Rasters of one camera with support and hole mask.
RenderBuffers render_camera(const Model& model,
                            const std::vector<SupportView>& inputs,
                            const Camera& camera);

/// The rendered colour as a picture: divided by alpha where alpha reaches one half, black in holes
/// without colour. Values in [0, 1].
ColorImage picture(const RenderBuffers& buffers);

/// World direction that is up in the photographs, by the axis all cameras were turned around
/// (people hold cameras level), or by the mean image up where the cameras do not turn.
Eigen::Vector3d world_up(const Scene& scene);

}  // namespace cgs
