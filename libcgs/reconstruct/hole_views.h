// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/raster.h"
#include "libcgs/reconstruct/model.h"
#include "libcgs/reconstruct/painted_fill.h"

namespace cgs {

/// Cameras to paint the holes of a model from.
struct HoleViews {
  std::vector<Camera> cameras;  ///< [internal units], the most telling first.
  size_t candidates = 0;        ///< Cameras that were looked at.
  double covered =
      0;  ///< Of the holes that the candidates see, the share these see; 1 without any.
};

/// Chooses few cameras that together see the holes in the neighbourhood of the input views: those
/// of views held out, those between input views, and those beside them, up to 20 degrees.
///
/// Every candidate's holes are points at hidden_depth(). A camera sees such a point if it falls on
/// a hole of its own with a depth that agrees within a tenth. Chosen is the camera that sees the
/// most points that none chosen before sees, until 95 % are seen, at most six.
///
/// \param left_open  which holes of a view will stay open all the same (1): they are not looked for,
///                   nor are those of a view that has others on less than a 400th of its picture
/// \throws InvalidInput if the model has no input views; NumericalError if no depth is known
/// Source: greedy cover, Nemhauser et al. 1978, "An analysis of approximations for maximizing
///         submodular set functions": at least 63 % of what the best choice of as many sees.
HoleViews hole_views(const Model& model,
                     const std::function<MaskMap(const ViewToPaint&)>& left_open = {},
                     const Progress& progress = {});

}  // namespace cgs
