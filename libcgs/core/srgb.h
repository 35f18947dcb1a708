// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace cgs {

/// Linear light of an sRGB-coded value; continued beyond 1, odd below 0. IEC 61966-2-1.
float linear_from_srgb(float value);

/// The inverse of linear_from_srgb().
float srgb_from_linear(float value);

}  // namespace cgs
