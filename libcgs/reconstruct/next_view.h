// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/reconstruct/model.h"

namespace cgs {

/// A place to take one more photograph from.
struct NextView {
  std::string name;    ///< Of the photograph that was taken there; empty = nobody stood there yet.
  Camera camera;       ///< [internal units]
  double open = 0;     ///< Share of its picture that no input view shows.
  double unsure = 0;   ///< Share that input views show and nothing measured.
  double shared = 0;   ///< Share that is measured, which places the photograph among the others.
  double worth = 0;    ///< In [0, 1]; see rank_next_views().
  size_t nearest = 0;  ///< Input view that stands nearest by direction, as position in scene.input.
  double right = 0;    ///< From that one to the right around what it looks at [rad]; < 0 = left.
  double higher = 0;   ///< And up [rad].
  double farther = 1;  ///< Distance to it, in those of the nearest input view.
};

/// Ranks cameras by what one more photograph from there would show that is not known: what no input
/// view shows counts fully, what nothing measured by half, both the less the less is shared. A
/// photograph that shares under 40 % of its picture is hard to place and to match. Sky counts as
/// nothing.
///
/// Like the information gain of FisherRF, that is what a photograph from there would tell; here it
/// is read from the hole masks and the evidence of the model.
/// \param candidates  with camera and name
/// \return the best first
/// Source: Jiang et al. 2024, "FisherRF: Active View Selection and Mapping with Radiance Fields
///         Using Fisher Information", for the question.
std::vector<NextView> rank_next_views(const Model& model,
                                      std::vector<NextView> candidates,
                                      const Progress& progress = {});

/// Input views that places_around() goes around, unless it is told otherwise: what is drawn from
/// there takes time.
inline constexpr size_t kMostGoneAround = 16;

/// Places around the input views, as far from what these look at: up to 45 degrees aside, and 20
/// higher or lower; twelve of each view.
/// \param most_views  of more, some are left out evenly
/// \throws NumericalError if no depth is known
std::vector<NextView> places_around(const Model& model, size_t most_views = kMostGoneAround);

/// The first of the ranked ones and those after it that stand at least 15 degrees from each one
/// before, `count` at most.
std::vector<NextView> apart(const Model& model, const std::vector<NextView>& ranked, size_t count);

}  // namespace cgs
