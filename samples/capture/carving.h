// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace cgs {

/// Height fields of the carved parts of the portal: how far the stone stands out [m] at x (centred)
/// and z (from the lower edge of the part) [m].

/// A figure in a mandorla between rosettes and foliage, in a half disc of the given radius.
double tympanum_height(double x, double z, double radius);

/// Rosettes that differ in size and number of petals, side by side along x.
double frieze_height(double x, double z, double height, uint32_t seed);

/// A standing figure with folds in its robe, in a panel of the given size.
double figure_height(double x, double z, double height, uint32_t seed);

/// One large rosette with rings, in a square with sides of 2 * radius centred at z = radius.
double medallion_height(double x, double z, double radius, uint32_t seed);

/// A door of planks with raised panels and rows of nail heads.
double door_height(double x, double z);

}  // namespace cgs
