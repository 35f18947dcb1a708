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
};

/// Of every pair of input views.
std::vector<Baseline> baselines(const Scene& scene);

/// What two views show both, as far as sparse points tell: what has no texture does not count.
struct Overlap {
  size_t points = 0;  ///< That both show.
  double share = 0;   ///< Of the pictures, in 8 x 6 cells, of the one where fewer hold such points.
};

Overlap overlap(const Scene& scene, int a, int b);

/// What a user should know before spending minutes: too little or too much baseline.
std::vector<std::string> baseline_warnings(const Scene& scene);

}  // namespace cgs
