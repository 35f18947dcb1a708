// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"

namespace cgs {

/// How splats differ from what they were before they were written.
struct SplatLoss {
  uint64_t dropped = 0;  ///< Splats that did not come back.
  /// Moves of centres [internal units]; empty if splats were dropped, so that nobody knows which of
  /// the two belong together.
  std::optional<double> largest_move, rms_move;
  double extent = 0;           ///< Diameter of the scene without its strays [internal units]; > 0.
  std::optional<double> psnr;  ///< Of pictures, where they show splats [dB]; infinity = the same;
                               ///< empty = they show too little to compare.
  size_t views = 0;            ///< Pictures of each.
  int sh_degree_before = 0;
  int sh_degree_after = 0;
  bool provenance_before = false;  ///< Whether every splat has a label.
  bool provenance_after = false;
};

/// Compares splats with what a file of them gave, both in one frame: centre by centre, and in
/// pictures of 256 x 256 pixels from a few virtual cameras.
///
/// \param order  index of the source splat of each written one; empty = the same order
/// \throws InvalidInput as virtual_cameras(); LimitError as rasterize()
SplatLoss splat_loss(const Gaussians& source,
                     const Gaussians& written,
                     std::span<const uint32_t> order,
                     const Progress& progress = {});

/// One line for people.
std::string splat_loss_line(const SplatLoss& loss, const Frame& frame);

/// {"dropped", "centres": {"largest_move", "rms_move", "unit", "largest_of_extent",
/// "rms_of_extent"}, "pictures": {"psnr", "views"}, "sh_degree": {"before", "after"}, "provenance":
/// {"before", "after": whether it is stated}}; lengths in file units, centres null if splats were
/// dropped; psnr is "same" for pictures that are, and null for those that show too little.
nlohmann::ordered_json splat_loss_to_json(const SplatLoss& loss, const Frame& frame);

}  // namespace cgs
