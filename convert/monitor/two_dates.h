// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "convert/monitor/changes.h"
#include "convert/text/figures.h"
#include "convert/text/terminal.h"
#include "libcgs/reconstruct/model.h"

namespace cgs {

/// Two reconstructions of one place, their surfaces in the frame of the earlier one.
struct TwoDates {
  Model earlier;
  Model later;
  MeasurableMesh earlier_surface;
  MeasurableMesh later_surface;
  /// Of the later surface, from where units alone put it: a point in its world, times `ratio`, in
  /// internal units of the earlier surface's frame.
  Registration motion;
  double ratio = 1;          ///< Units of the earlier date per unit of the later.
  size_t shared_places = 0;  ///< That photographs of both dates show; 0 where they were not asked.
  size_t agreeing_places = 0;
  /// Relative standard deviation of one date's scale against the other's, where both know theirs; 0
  /// where one was fitted to the other.
  double scale_sigma = 0;
  /// What an error of the scale leaves in its place [internal units].
  Eigen::Vector3d scale_center = Eigen::Vector3d::Zero();

  /// A point in the world of the later date, or of the earlier, in the frame of the surfaces.
  Eigen::Vector3d from_later(const Eigen::Vector3d& world) const {
    return motion.apply(earlier_surface.frame.internal_from_world(ratio * world));
  }
  Eigen::Vector3d from_earlier(const Eigen::Vector3d& world) const {
    return earlier_surface.frame.internal_from_world(world);
  }
};

/// Reads two folders of `cgs run` and lays the later surface onto the earlier: by what photographs
/// of both show, then by the surfaces, each robustly, so that what changed pulls little. The scale
/// is fitted, too, unless both dates know theirs.
///
/// \param is_registered  both are in one frame already: nothing is moved
/// \throws BadInput for a folder without model or surface; NumericalError where the photographs
///         share too little, naming what helps
TwoDates read_two_dates(const std::filesystem::path& earlier,
                        const std::filesystem::path& later,
                        bool is_registered,
                        Terminal& terminal);

/// What was gained and lost.
struct DateChanges {
  Changes gained;  ///< Of the later surface, over the earlier.
  Changes lost;    ///< Of the earlier surface, over the later.
};
DateChanges changes_between(const TwoDates& dates, const Progress& progress);

/// {"unit", "registration": {"shared_places", "agreeing_places", "scale", "rms", "share"},
/// "gained", "lost": {"area", "volume", "volume_sigma", "without_volume", "comparable", "noise",
/// "detection", "patches": [{"area", "distance", "volume", "volume_sigma", "center"}]}}: see
/// docs/schema
nlohmann::ordered_json monitor_json(const TwoDates& dates,
                                    const DateChanges& changes,
                                    const FigureUnit& unit);

}  // namespace cgs
