// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "io/scenes/scene_options.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// The views whose photograph is there.
/// \return indices into scene.views, ascending
std::vector<int> views_with_files(const Scene& scene);

/// The divisors of image sizes, one per view, as SceneOptions::downscale says where that is empty:
/// of the largest size, or of a smaller one that lets enough photographs in. What is chosen becomes
/// a note of the scene.
std::vector<int> choose_divisors(Scene& scene, const SceneOptions& options);

/// Chooses Scene::input and Scene::held_out, and notes why no more are used.
///
/// Input views as the options say, else as choose_input_views() does; of an LLFF scene, and where
/// that finds none, by the LLFF protocol: of the views that have a file, in name order, those at 0,
/// 8, 16 … are not taken, three at even distances of the rest are. Held out are all others that
/// have a file, of very many some from first to last.
/// Source: Niemeyer et al. 2022, "RegNeRF", supplement.
///
/// \throws InvalidInput (a view that does not exist, is named twice, has no file or is the only one
///         named), BadInput Empty (fewer than two views)
void choose_views(Scene& scene, const SceneOptions& options);

}  // namespace cgs
