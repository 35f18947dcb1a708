// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

namespace cgs {

/// What maps, attributes and figures hold where there is no value.
inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

}  // namespace cgs
