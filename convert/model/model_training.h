// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/reconstruct/evidence_words.h"
#include "libcgs/reconstruct/reconstruct.h"

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
  /// Hears of a checkpoint that could not be read or written, which changes no result.
  std::function<void(const std::string&)> warn = {};
  Medium medium = Medium::None;  ///< As ReconstructionOptions::medium.
  /// Splats that free Gaussians begin from, in the coordinates of the scene; empty = none.
  std::filesystem::path start = {};
};

/// reconstruct() of a scene from its files, going on from a checkpoint of the same work. If the
/// progress function throws Cancelled, the training so far is saved first.
/// \throws BadInput Mismatch for a checkpoint of other work that is to be kept; as load_images(),
///         DepthNetwork and reconstruct()
TrainedModel train_model(Scene scene, const ModelRequest& request, const Progress& progress);

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

/// Mean share of the photographs that is measured, of what shows surface that stands still, from
/// "depth_of_views" of training_to_json().
/// \pre it tells of a view
double measured_share(const nlohmann::ordered_json& depth_of_views);

/// What training_to_json() tells of the photographs that their owner may not know.
std::vector<std::string> remarks_on_photographs(const nlohmann::ordered_json& training);

}  // namespace cgs
