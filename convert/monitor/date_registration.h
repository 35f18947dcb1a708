// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/progress.h"
#include "libcgs/reconstruct/model.h"
#include "meshing/measure/registration.h"

namespace cgs {

/// A place that photographs of two dates both show.
struct PlacePair {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double tolerance = 0;  ///< How far `from`, once moved, may lie from `to`; > 0.
};

/// The motion that most pairs agree on, and how many of them do.
struct PlaceFit {
  Registration motion;
  size_t agreeing = 0;
};

/// The similarity (a rigid motion without `with_scale`) that most pairs agree on: of triples, the
/// one with which most agree, then fitted to these. The same for the same pairs.
/// \return no agreement at all for fewer than three pairs
/// Source: Fischler and Bolles 1981, "Random sample consensus"; Umeyama 1991, "Least-squares
///         estimation of transformation parameters between two point patterns".
PlaceFit fit_places(const std::vector<PlacePair>& pairs, bool with_scale);

/// Places that the input photographs of two models both show, where both measured their depth,
/// each in the world coordinates of its model; the tolerance is a hundredth of the depth in
/// `earlier`. Loads photographs.
/// \throws BadInput for photographs that cannot be read
std::vector<PlacePair> places_of_both(Model& earlier, Model& later, const Progress& progress);

}  // namespace cgs
