// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "io/scenes/given_depth.h"

namespace cgs {

/// What to take of a scene on disk.
struct SceneOptions {
  /// Input views: comma-separated names (file stems) or indices in name order; a name wins where
  /// both fit. Empty = choose: all of at most four, of more those that together show the most and
  /// others far from these, up to kMostPixels but at least three, seven of eight at most; of an
  /// LLFF scene those of its protocol.
  std::string views;
  bool all_views = false;  ///< Where `views` is empty, take every one.
  /// Divide image sizes by this; >= 1. Empty = choose: the smallest that leaves no side above
  /// kLongestSide or, of many photographs that are chosen among, lets kWantedViews of them in;
  /// photographs much smaller than the largest have one of their own. What was chosen becomes a
  /// note.
  std::optional<int> downscale;
  /// Of Metashape's cameras, the chunk to read: its label or its index from 0. Empty = the first
  /// with aligned cameras.
  std::string chunk;
  bool allow_external = false;  ///< Follow links and absolute paths that leave the scene folder.
  DepthOptions depth;

  /// Three photographs of this size take minutes on two cores; time grows with their pixels.
  static constexpr int kLongestSide = 1024;  // [pixels]
  /// Of all input views that are chosen together: some five minutes on two cores.
  static constexpr double kMostPixels = 3.2e6;
  /// So many input views, where there are, are worth smaller pictures, but of this longest side at
  /// least [pixels].
  static constexpr size_t kWantedViews = 12;
  static constexpr int kShortestChosen = 400;
  static constexpr size_t kTakesAll = 4;      ///< Of so many photographs none is left out.
  static constexpr size_t kHeldOutEvery = 8;  ///< Of more, one in so many is, at least.

  /// How many of so many photographs are wanted as input views where `views` names none: all of few
  /// or where that is asked for, of more kWantedViews.
  size_t wanted_views(size_t photographs) const;

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// The most input views of so many photographs: those held out tell how good the others are.
size_t most_inputs(size_t photographs);

}  // namespace cgs
