// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// Reads every photograph, and depth of input views, before anything is written: a run must not
/// stop halfway, or leave a folder behind, because of a damaged file. Photographs that the run
/// works with stay in the cache of the scene.
///
/// \param room  memory that may be taken [bytes]: as many are read at once as it holds, one at
///              least
/// \throws Error of the first that cannot be read, in the order of the scene, as loaded_view(),
///         read_image() and read_depth_file()
void refuse_unreadable(const Scene& scene, size_t room, const Progress& progress);

}  // namespace cgs
