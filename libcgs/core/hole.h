// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace cgs {

/// Why no input view can vouch for a pixel of a rendered view. The numbers are those in files, in
/// which 4 is what a mask leaves out.
enum class Hole : uint8_t {
  None = 0,         ///< Seen by an input view.
  Transparent = 1,  ///< Alpha below the threshold: nothing was reconstructed along the ray.
  Occluded = 2,     ///< What is drawn lies within input pictures, but none shows it: it is hidden.
  Outside = 3,      ///< Outside of every input picture: what is drawn, or else all of the ray.
  Estimated = 5,  ///< An input view shows it, but nothing measured its depth. No hole in a picture.
  Sky = 6,        ///< An input view shows sky, which has no surface. No hole in a picture.
};
inline constexpr int kHoleKinds = 7;

/// Whether no input view shows what is drawn.
constexpr bool is_hole(Hole kind) {
  return kind == Hole::Transparent || kind == Hole::Occluded || kind == Hole::Outside;
}

}  // namespace cgs
