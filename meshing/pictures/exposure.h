// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "libcgs/core/exposure.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/pictures/face_views.h"

namespace cgs {

/// The gains of views from the middles of faces that several of them show.
/// \param compared  as exposure_gains() of core/exposure.h takes them
/// \throws Error as exposure_gains() of core/exposure.h
ExposureGains exposure_gains(const TriangleMesh& mesh,
                             const FaceScores& scores,
                             const std::vector<View>& views,
                             const std::vector<std::pair<size_t, size_t>>& compared);

}  // namespace cgs
