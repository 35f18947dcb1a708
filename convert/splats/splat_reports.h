// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "libcgs/splats/floaters.h"
#include "libcgs/splats/splat_thinning.h"

namespace cgs {

/// {"removed", "haze", "needles", "islands", "not_judged", "doubtful", "cell"}, the cell in file
/// units.
nlohmann::ordered_json floaters_to_json(const Floaters& floaters, const Frame& frame);

/// {"kept", "of", "chosen", "most_loss_db", "unseen_psnr", "tried": [{"most_cost", "splats",
/// "loss_db"}]}
nlohmann::ordered_json thinning_to_json(const ThinnedSplats& thinned, size_t before);

/// What splats rest on, in words, with some that were made up among them.
std::string with_synthetic(std::string evidence, size_t count);

}  // namespace cgs
