// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace cgs {

/// Why no input view can vouch for a pixel of a rendered view.
enum class Hole : uint8_t {
  None = 0,         ///< Seen by an input view.
  Transparent = 1,  ///< Alpha below the threshold: nothing was reconstructed along the ray.
  Occluded = 2,     ///< What is drawn lies within input pictures, but none shows it: it is hidden.
  Outside = 3,      ///< Outside of every input picture: what is drawn, or else all of the ray.
};

}  // namespace cgs
