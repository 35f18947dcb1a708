// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Whether a photograph has no colours of its own: its channels are equal, or, as in sepia, what
/// they differ by follows from how light a pixel is.
/// \param valid  empty = everywhere
bool has_no_colors(const ColorImage& image, const MaskMap& valid);

/// Marks input views without colours among others with colours (PhotoResponse::is_grey) and leaves
/// their luminance alone. Where no view has colours, none is marked.
/// \return whether any was marked
/// \pre images of scene.input are loaded
bool mark_grey_photographs(Scene& scene);

/// Whether an input view is marked so.
bool has_grey_photographs(const Scene& scene);

/// A copy of the scene with input views that show their luminance alone, by which all can be
/// compared.
Scene in_luminance(const Scene& scene);

/// Gives places that grey views show the colours that other input views have there, at the
/// luminance of the grey one.
///
/// A place is shared where the depths of both views lie within 2 % of each other; several views
/// are averaged.
/// \param priors  of scene.input, in its order
/// \return per input view, of the pixels of a grey one that show surface 1 where no other view told
///         a colour; empty for views with colours
std::vector<MaskMap> color_grey_photographs(Scene& scene, const std::vector<ViewPriors>& priors);

}  // namespace cgs
