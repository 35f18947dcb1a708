// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// Photographs that are reconstructed together.
struct ViewGroup {
  std::vector<int> own;  ///< Indices into scene.views, ascending; each input view is one group's.
  std::vector<int> all;  ///< These and those of other groups that show the same; ascending.
};

/// Cuts the input views of a large scene into groups, so that each can be reconstructed by itself:
/// by halves across where cameras and what they look at extend the most, until none has more own
/// views than three quarters of `size`. Views of others that look at the same fill a group up.
///
/// \param size  of a group at most; 3 or more
/// \return one group where there are no more views than that
/// \throws InvalidInput for a smaller size
std::vector<ViewGroup> group_views(const Scene& scene, size_t size);

}  // namespace cgs
