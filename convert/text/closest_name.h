// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cgs {

/// Which of some names was probably meant: the one that fewest letters must be added, left out,
/// changed or swapped with their neighbours for, if at most two and fewer than half of those typed;
/// empty if there is none.
std::string closest_name(std::string_view typed, const std::vector<std::string>& names);

}  // namespace cgs
