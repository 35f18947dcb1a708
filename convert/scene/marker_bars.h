// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/scale_bars.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// The side of printed markers as a scale bar, from one marker.
struct MarkerBar {
  std::string name;
  int photographs = 0;  ///< That show it.
  ScaleBar bar;
  /// Relative standard deviation of its side by what shifts the corners of all markers alike.
  double common_sigma = 0;
};

/// Measures the sides of square markers that two or more input photographs show, by intersecting
/// the rays through their corners.
///
/// The sigma of a side is that of corners found to a fifth of a pixel of the photographs. What is
/// no square in space, by more than a tenth of its side and three sigma, is no marker.
/// \param scene  with cameras in internal units and photographs on disk
/// \param size   outer side of the black square as printed, "80mm" or "80mm+-0.2mm"; none
///              are looked for where it is empty
/// \throws InvalidInput for a size that cannot be read, or, saying what was found where, if no
///         marker is shown by two photographs
std::vector<MarkerBar> marker_bars(const Scene& scene, const std::string& size);

}  // namespace cgs
