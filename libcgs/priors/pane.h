// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// A flat sheet in front of the scene that lets it through and shows something of its own: a
/// window, the glass of a case or of a frame.
struct Pane {
  size_t drawn_from = 0;           ///< Position in Scene::input of the view whose pixels it has.
  DepthMap depth;                  ///< z-depth in that view [internal units]; NaN beside the pane.
  ColorImage color;                ///< What it shows itself, where its depth is known.
  float opacity = 0;               ///< In [0.05, 0.45]: what lies behind stays the surface.
  std::vector<ColorImage> behind;  ///< What each input view would show without it.
  double gain = 0;                 ///< As foretelling_gain() [dB].
};

/// Finds a pane, if three to nine views show two things at once.
///
/// Where views agree on the depth of a surface and not on its colour, what is left of each
/// photograph without what the others show is matched again. What then lies in front, on one plane,
/// is where a pane may be; it reaches as far as all views differ so. Its opacity is what surfaces
/// lose of their contrast through it, 0.3 where nothing of it is seen from beside; its colours are
/// pane_colors(). It is there if hidden pixels are predicted at least 1 dB better with it
/// (foretelling_gain()).
///
/// \param priors  of scene.input, in its order
/// \pre images of scene.input are loaded and matched in exposure; the scene is in its canonical
///      frame
std::optional<Pane> find_pane(const Scene& scene,
                              const std::vector<ViewPriors>& priors,
                              const Progress& progress = {});

/// The scene as its input views would show it without the pane.
Scene behind_pane(const Scene& scene, const Pane& pane);

}  // namespace cgs
