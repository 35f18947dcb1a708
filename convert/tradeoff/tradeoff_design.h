// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "convert/run/run_request.h"

namespace cgs {

/// What a user may turn to trade speed for accuracy; the defaults are those of `cgs run`.
struct Setting {
  int coarser = 1;   ///< Image sizes are divided by this on top of what the user asked for.
  int steps = 60;    ///< Of the training.
  double voxel = 1;  ///< Voxel edge, in parts of what the program chooses for the image size.
  /// Largest error of simplification [voxels of the standard setting]; 0 = none.
  std::optional<double> simplify = {};
  /// Largest error of the compressed mesh [voxels of the standard setting].
  std::optional<double> max_error = {};
  int repeat = 0;  ///< The same once more, to see how far times differ by themselves.

  bool operator==(const Setting&) const = default;
};

/// In a word or two, e.g. "1/2 size, voxel x1.5"; "standard" for the defaults.
std::string label(const Setting& setting);

/// Names of the stages a setting consists of. Settings that share a name share what the stage made:
/// the model, the meshes made from it, the assets made from those.
std::string model_key(const Setting& setting);
std::string mesh_key(const Setting& setting);
std::string asset_key(const Setting& setting);

/// The settings to measure, those that tell most first: each parameter changed by itself, and the
/// corners where changing two of them should pay. The first is the standard setting.
///
/// Not in it, as it moves pictures by 0.1 dB and time by nothing: the knots of the lattices.
std::vector<Setting> tradeoff_design();

/// The run that a setting stands for.
///
/// \param standard        what the user asked for
/// \param downscale       of the standard setting
/// \param standard_voxel  its voxel edge [scene units]; a setting that does not need it may be
///                        asked for before it is known, with 0
RunRequest request_of(const Setting& setting,
                      const RunRequest& standard,
                      int downscale,
                      double standard_voxel);

/// The command line of a run, to be pasted into a shell.
/// \param threads  0 = all
std::string command_line(const RunRequest& request, int threads = 0);

}  // namespace cgs
