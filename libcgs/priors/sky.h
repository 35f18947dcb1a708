// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// The sky of a photograph: 1 where there is some, empty where there is none.
///
/// Sky is even from pixel to pixel and reaches the border of the picture that is up. It is blue or
/// brighter than nearly everything else, or else is along most of that border and brighter than
/// most of the rest. From there it is followed as far as it stays so; what it encloses is sky, too,
/// if it is white (clouds), and so is what shows the same colours a small way behind its rim
/// (between bars and branches). Its rim reaches up to where the colours change: what was measured
/// there is the silhouette before it, which matching makes too wide. A surface that looks alike but
/// was measured nearby, all over, such as a white wall, is no sky.
///
/// \param up  world direction that is up; zero = the top of the picture
/// \param priors  of plane_sweep(), or empty rasters where nothing was measured
MaskMap find_sky(const View& view, const ViewPriors& priors, const Eigen::Vector3d& up);

/// The same for the input views of a scene, in their order: what looks like the sky of another view
/// need not stand out from the rest of its own. Up is the top of the pictures; of those that lie on
/// their side beside others and, where no sky is found so, of all, it is frame.up.
std::vector<MaskMap> find_sky(const Scene& scene, const std::vector<ViewPriors>& priors);

/// Marks sky and what was measured there by mistake: origin Sky, without depth.
void enter_sky(const MaskMap& sky, ViewPriors& priors);

/// Gives sky the depth of a backdrop, far behind everything that was measured in any view.
void set_backdrop(std::vector<ViewPriors>& views);

/// Median depth of the pixels of all these views that show a surface [internal units], or of the
/// backdrop where nothing but sky has a depth; nothing where no pixel has one.
std::optional<float> median_depth(std::span<const ViewPriors> views);

}  // namespace cgs
