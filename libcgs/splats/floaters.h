// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "libcgs/core/gaussians.h"

namespace cgs {

/// Splats that float in free space and belong to no surface.
struct Floaters {
  std::vector<uint8_t> keep;  ///< Per Gaussian, 0 = a floater.
  size_t haze = 0;            ///< Most of it lies where all splats together stop hardly any light.
  size_t needles = 0;         ///< Long and thin, and most of it lies where no other splat is.
  size_t islands = 0;         ///< Solid, but in a part of a few splats that touches nothing else.
  size_t outside = 0;         ///< Not judged: too far from the scene. Kept.
  double cell = 0;        ///< Edge of the cells in which matter is told from free space [internal].
  bool doubtful = false;  ///< So many that these splats are no surface with floaters: all are kept.

  size_t count() const { return haze + needles + islands; }
};

/// Tells floaters from splats that make surfaces, by the splats alone.
///
/// Space is divided into cells of a 200th of the scene, or larger where splats are sparse. A cell
/// holds matter if the opacities of the splats that reach it (within 1.5 sigma, weighted by their
/// Gaussians) sum up to a quarter. Opacity is not spread over the cell, so that thin wires count as
/// matter, too. Then
/// - haze has less than half of its mass in matter or in cells that touch it,
/// - needles, five times as long as wide and longer than two cells, have less than a quarter of
///   theirs at what the others make matter,
/// - of what is left, parts of matter that do not touch, and hold fewer than a two-thousandth of
///   all splats (at least 30, if that is no more than a hundredth of them), are islands.
///
/// The scene is the cube of one and a half times the size of the box from the 1st to the 99th
/// percentile of the splats of opacity 0.1 and more. Same bits for any number of threads.
/// \throws InvalidInput if there are no Gaussians
Floaters find_floaters(const Gaussians& gaussians);

/// "removed 312 of 7000 splats as floaters: 100 haze, …"
std::string floaters_text(const Floaters& floaters);

}  // namespace cgs
