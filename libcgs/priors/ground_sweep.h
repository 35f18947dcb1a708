// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/semi_global.h"
#include "libcgs/priors/slanted_refinement.h"
#include "libcgs/priors/sweep_geometry.h"

namespace cgs {

/// How far what a pixel (u, v, 1) shows lies below the camera, per depth, as a row to multiply
/// pixels with: level planes change their inverse depth in proportion. Zero where `up` is.
Eigen::RowVector3d level_drop(const Camera& camera, const Eigen::Vector3d& up);

/// Ground that the views look along, as starts for their refinement: a sweep of level planes at
/// half size, refined there. A sweep of planes square to the view finds no pavement, lawn or floor:
/// from row to row its depth changes by several planes, so that no window of it is like its match.
///
/// \param scene     as plane_sweep() takes it
/// \param geometry  of every input view, in whose planes the result is
/// \return per input view and pixel, t NaN where there is none; empty for views that no ground is
///         looked for in: where Frame::up is not known, pictures have less than 64 pixels, or
///         nothing of them lies well below the horizon
/// Source: Gallup et al. 2007, "Real-time plane-sweeping stereo with multiple sweeping directions".
std::vector<Raster<SlantedPlane>> ground_planes(const Scene& scene,
                                                const std::vector<SweepGeometry>& geometry,
                                                const SweepSampling& sampling,
                                                const SmoothnessPenalties& smoothness,
                                                const Progress& progress = {});

}  // namespace cgs
