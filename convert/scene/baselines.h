// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// How two input views stand to each other.
struct Baseline {
  int a = 0;            ///< Index of Scene::views.
  int b = 0;            ///< Likewise.
  double length = 0;    ///< [scene units]
  double to_depth = 0;  ///< The same as a share of the depth of what `a` shows.
  double angle = 0;     ///< Between the directions they look in [rad].
  size_t points = 0;    ///< Sparse points that both show.
  /// Share of the pictures, in 8 x 6 cells, where there are such points; of the picture with less.
  /// What they share without texture is not counted.
  double overlap = 0;
};

/// Of every pair of input views.
std::vector<Baseline> baselines(const Scene& scene);

/// What a user should know before spending minutes: too little or too much baseline.
std::vector<std::string> baseline_warnings(const Scene& scene);

}  // namespace cgs
