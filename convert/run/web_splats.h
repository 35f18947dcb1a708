// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "libcgs/core/progress.h"

namespace cgs {

/// Writes the splats of a model for viewers in browsers: splats.glb and splats.spz, thinned by
/// thin_splats(); SPZ tells places apart to a sixteenth of a pixel. Splats that reach too far for
/// SPZ are no reason to end a run: it is left out then.
/// The .glb says what the model rests on, and what vouches for each splat where that is stated; SPZ
/// has no place for these.
/// \return {"thinning": {…, "held_out": mean of evaluate_views() or null}, "splats.glb": {…},
///          "splats.spz": {…}, "left_out": {"splats.spz": "why"}}
/// \param model  as before when this returns or throws
/// \throws as load_images()
nlohmann::ordered_json write_web_splats(const std::filesystem::path& folder,
                                        Model& model,
                                        const Progress& progress = {});

}  // namespace cgs
