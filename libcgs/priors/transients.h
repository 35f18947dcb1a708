// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// What was there while one photograph was taken and gone or elsewhere in the others: people, cars,
/// leaves. Per input view, in the order of Scene::input, 1 where it is shown; empty where there is
/// none.
///
/// A pixel shows it where two other photographs measured one surface behind and agree on its
/// colour, the pixel has another, and no place between its camera and that surface explains it in
/// two others as well, or in the only other that has the place in its picture: what stands still
/// before a surface would be found there. With two photographs nobody can tell which of them is
/// right, and nothing is found.
/// \param priors  of plane_sweep(), or later
/// \pre images of scene.input are loaded
/// Source: robust photo-consistency between views, as Sabour et al. 2023, "RobustNeRF", uses it
///         against distractors; the test by measured depth is our own.
std::vector<MaskMap> find_transients(const Scene& scene, const std::vector<ViewPriors>& priors);

/// Marks them in the priors: origin Transient, without depth.
void enter_transients(const MaskMap& transients, ViewPriors& priors);

/// Where the priors say that there are some; empty where there are none.
MaskMap transient_mask(const ViewPriors& priors);

/// Takes them, and the background of an object that stands alone, out of the valid pixels of a
/// view.
void mask_other_than_scene(const ViewPriors& priors, View& view);

}  // namespace cgs
