// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "meshing/volume/tsdf_view.h"

namespace cgs {

/// How well depth frames fit each other, and whether that shows that cameras and depth have the
/// same unit.
struct DepthAgreement {
  /// Median relative difference between the depth of frames at the same place; NaN = too few pairs
  /// of frames show the same.
  double off = std::numeric_limits<double>::quiet_NaN();
  /// Depth multiplied by this agrees best; another factor than 1 must be clearly better than 1. NaN
  /// as above for every factor.
  double best_factor = std::numeric_limits<double>::quiet_NaN();
  /// True if depth as it is agrees, and smaller and larger depth does not: cameras that hardly move
  /// and plain walls agree with depth of any unit.
  bool shows_scale = false;
};

/// Compares some of the frames, at some of their pixels, with depth as it is and with depth of
/// other units.
/// \param cameras  of all frames [internal units]
/// \param frame    the depth frame of a number; asked for some of them, one after the other, of
///                 which samples are kept
DepthAgreement depth_agreement(const std::vector<Camera>& cameras,
                               const std::function<TsdfView(size_t)>& frame);

}  // namespace cgs
