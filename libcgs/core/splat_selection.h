// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/core/gaussians.h"

namespace cgs {

/// Leaves only the Gaussians where `keep` is not 0, in their order.
/// \pre keep has one entry per Gaussian
/// \return how many went
size_t keep_only(Gaussians& gaussians, const std::vector<uint8_t>& keep);

}  // namespace cgs
