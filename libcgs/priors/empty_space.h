// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "libcgs/core/camera.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Another view as a witness of empty space: nothing stands before what it measured.
struct CompletionWitness {
  const Camera* camera = nullptr;      ///< Not owned.
  const ViewPriors* priors = nullptr;  ///< Not owned. Only measured pixels and sky speak.
};

/// Whether a witness sees past points of a view.
class EmptySpace {
 public:
  /// \pre the camera, and the priors of the witness, outlive this
  EmptySpace(const Camera& camera, const CompletionWitness& witness);

  /// Whether the witness sees past the point of pixel (x, y) at an inverse depth > 0: by more than
  /// 3 % of its depth and 3 sigma, in all of its four pixels around; one alone may differ next to a
  /// depth edge.
  bool holds(int x, int y, float inverse_depth) const;

 private:
  bool is_past(int i, int j, float depth) const;

  const Camera& camera_;
  const ViewPriors& priors_;  // of the witness
  Eigen::Matrix3f turn_;
  Eigen::Vector3f shift_;
};

}  // namespace cgs
