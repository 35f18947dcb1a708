// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/train/trainer.h"

namespace cgs {

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
  std::function<void(const Model&, const PriorsReport&)> inspect = {};
};

/// What became of a pane in the photographs.
struct PaneReport {
  std::string view;    ///< The one it is drawn from; empty = there is none.
  double share = 0;    ///< Of the pixels of that view.
  double opacity = 0;  ///< Before the training.
  double gain = 0;     ///< Pane::gain [dB]
};

/// A model, and how it was come by.
struct TrainedModel {
  Model model;
  PriorsReport priors;
  float exposure_difference = 0;  ///< ExposureGains::difference() of the input views
  ViewDependence view_dependence;
  PaneReport pane;
  std::vector<StepReport> steps;  ///< Of the training; empty = aligned initialisation.
  /// Checkpoints that could not be read or written, for the terminal: they change no result.
  std::vector<std::string> hitches;
};

/// Scene -> model. Loads the images of the input views, moves the scene to its canonical frame,
/// estimates depth and optimises the Gaussians; goes on from a checkpoint of the same work. Where
/// the photographs show a pane, depth is estimated once more from what lies behind it.
/// If the progress function throws Cancelled, the training so far is saved first.
/// \throws BadInput Mismatch for a checkpoint of other work that is to be kept
TrainedModel train_model(Scene scene, const ModelRequest& request, const Progress& progress);

/// How much of each input view was measured, is sky, is estimated or stays open; a line each, for
/// people.
std::vector<std::string> coverage_words(const PriorsReport& priors, const Scene& scene);

/// Gives a frame without scale the one that metric depth of the photographs tells, if it does.
void take_sensor_scale(const GivenDepthReport& given, Frame& frame);

/// True if a training began in that folder and did not end.
bool has_checkpoints(const std::filesystem::path& folder);

/// Removes the checkpoints of finished work.
/// \throws IoError
void forget_checkpoints(const std::filesystem::path& folder);

/// Every field of the options and its value, as set_training_field() takes them.
nlohmann::ordered_json settings_to_json(const TrainingOptions& options);

/// What was done, for run.json, the report and OUT/model/training.json: a description in plain
/// words, the effective settings, and the loss over the steps.
nlohmann::ordered_json training_to_json(const TrainedModel& trained, const ModelRequest& request);

/// The scale that training_to_json() tells of, as take_sensor_scale() takes it.
/// \throws nlohmann::json::exception
GivenDepthReport recorded_sensor_scale(const nlohmann::ordered_json& training);

/// What training_to_json() tells of the photographs that their owner may not know.
std::vector<std::string> remarks_on_photographs(const nlohmann::ordered_json& training);

}  // namespace cgs
