// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// True if one size is the other, scaled and rounded to whole pixels.
bool have_same_shape(int width_a, int height_a, int width_b, int height_b);

/// "4032 x 3024", for messages.
std::string size_text(int width, int height);

/// Scales cameras to the size of their photographs, which becomes a warning where a layout does not
/// state the size of other files than these.
/// \throws BadInput Mismatch (another shape)
void fit_cameras(Scene& scene);

/// From here on a view through a fisheye has the camera of its undistorted picture.
/// \throws BadInput as check_fisheye()
void make_pinholes(Scene& scene);

/// The divisors of image sizes where the options state none, one per view: that of the largest
/// photograph (of a fisheye, its undistorted picture), so that no side is above `longest`. A
/// photograph of which it would leave half or less of what is possible has its own: cameras whose
/// sizes differ little agree.
std::vector<int> divisors_to(const Scene& scene, int longest);

/// What was chosen, for a note; empty where nothing is divided.
std::string divisors_text(const Scene& scene, const std::vector<int>& divisors);

/// Makes cameras smaller, rounded down to whole pixels.
/// \param divisors  one per view
/// \throws InvalidInput (a side would be shorter than 8 pixels)
void divide_sizes(Scene& scene, const std::vector<int>& divisors);

}  // namespace cgs
