// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// A place as a photograph shows it.
struct ShownPlace {
  Eigen::Vector3d light = Eigen::Vector3d::Zero();  ///< linear
  double r2 = 0;                                    ///< squared_radius()
};

/// A place that two photographs show.
struct SharedPlace {
  ShownPlace a, b;
  double coded = 0;  ///< Mean of its six sRGB-coded values.
};

/// Means of linear light over 3 x 3 pixels, of which registration and noise make less; NaN where
/// one of them is clipped, nearly black or masked.
ColorImage smooth_light(const View& view);

/// What shared_places() asks of a view.
struct LitView {
  const View& view;
  const ViewPriors& priors;
  const ColorImage& light;  ///< smooth_light()
};

/// Places that `a` measured and `b` measured alike, on a grid of `a` so wide that what is odd about
/// one says little of the next.
std::vector<SharedPlace> shared_places(const LitView& a, const LitView& b);

}  // namespace cgs
