// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "convert/run/run_request.h"
#include "convert/run/stage_cost.h"
#include "convert/tradeoff/recommendation.h"
#include "convert/tradeoff/surface_error.h"
#include "convert/tradeoff/tradeoff_design.h"

namespace cgs {

struct TradeoffRequest {
  SceneRequest scene;
  std::filesystem::path output;
  std::filesystem::path reference;  ///< A mesh that counts as the truth; empty = none.
  double minutes = 20;              ///< No stage goes on for longer; 0 = only tell what is there.
  bool overwrite = false;           ///< Measurements of another scene are replaced.
  size_t memory_limit = 0;          ///< As in RunRequest.
  int threads = 0;                  ///< That it may use, as times depend on them; 0 = all.
};

/// Rendered views against photographs that were held out, at the size of the standard setting.
struct PictureQuality {
  double psnr = 0;  ///< [dB]
  double ssim = 0;
  double psnr_seen = 0;  ///< Without hole pixels.
  double ssim_seen = 0;
};

/// One setting and what was measured. Lengths are in scene units.
struct MeasuredSetting {
  Setting setting;
  std::string command;  ///< `cgs run …`
  std::string failed;   ///< Why there is no result; empty = there is one.
  StageCost model;      ///< From photographs to Gaussians and views; with solving for cameras.
  StageCost mesh;       ///< From there to meshes.
  StageCost assets;     ///< From there to what a web page shows.
  std::optional<PictureQuality> pictures;  ///< Empty if no view was held out.
  std::optional<SurfaceError> deviation;   ///< From the finest surface that was measured.
  bool is_ruler = false;                   ///< Its own surface is what errors are measured from.
  std::optional<SurfaceError> truth;       ///< From the reference.
  double voxel = 0;
  double asset_error = 0;  ///< What 95 % of asset.glb are off the watertight mesh at most.
  size_t faces = 0;        ///< Of the watertight mesh.
  size_t model_bytes = 0;  ///< gaussians.ply
  size_t mesh_bytes = 0;   ///< watertight.ply
  size_t asset_bytes = 0;  ///< asset.glb

  double cpu() const { return model.cpu + mesh.cpu + assets.cpu; }
  double wall() const { return model.wall + mesh.wall + assets.wall; }
  /// Of the surface: 95 % of it are within, against the truth where there is one; NaN = unknown, as
  /// that of the ruler is.
  double error() const;
  /// With the error of asset.glb added.
  double asset_and_surface_error() const { return error() + asset_error; }
};

struct Tradeoff {
  std::vector<MeasuredSetting> settings;  ///< Finished ones, in the order of the design.
  std::vector<std::string> left_out;      ///< Labels of those there was no time for.
  TradeoffNoise noise;
  int repeats = 0;     ///< Times the standard setting was measured.
  std::string finest;  ///< Label of the setting that deviations are from; empty = none yet.
  Scene scene;         ///< As the standard setting opens it.
};

/// Measures the settings of tradeoff_design() on a scene.
///
/// Finished stages are kept in request.output (run.json) and not done again. Where the standard
/// setting cannot be done its error is thrown; another one that cannot is told as failed.
/// \param opened  the scene of the standard setting
/// \throws InvalidInput if the folder holds results of another scene or the reference does not fit;
///         LimitError if time was up before the standard setting was done; IoError; Cancelled
Tradeoff measure_tradeoff(const TradeoffRequest& request,
                          const OpenedScene& opened,
                          const StageCost& opening,
                          Terminal& terminal);

/// What recommend() takes, in the order of the settings; of failed ones all is NaN.
std::vector<TradeoffFigures> figures_of(const Tradeoff& tradeoff);

}  // namespace cgs
