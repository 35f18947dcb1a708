// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"

namespace cgs {

/// Widths of the border of a picture [pixels]; 0 = that side has none.
struct ScanBorder {
  int left = 0;
  int right = 0;
  int top = 0;
  int bottom = 0;

  bool operator==(const ScanBorder& other) const = default;
};

/// Finds the even border around a scanned print: paper around it, or the black of the scanner.
///
/// A side has one where its outermost rows or columns are of one colour along their whole length,
/// and this ends at one straight step to the picture, at most a quarter of its size inwards. One
/// side alone is no border: a clear sky or a white wall may look so.
ScanBorder find_scan_border(const ColorImage& image);

/// Takes the border out of the pixels that may be used, with two pixels beside it, and what it
/// fills of rounded corners of the picture.
/// \param usable  of the size of the image; empty = all
void mask_scan_border(const ColorImage& image, MaskMap& usable);

}  // namespace cgs
