// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/model/evaluation.h"
#include "convert/model/hole_pictures.h"
#include "convert/model/model.h"
#include "io/splats/spz.h"
#include "libcgs/core/progress.h"
#include "libcgs/splats/splat_thinning.h"

namespace cgs {

struct WebSplatsOptions {
  HoleFill fill = HoleFill::None;  ///< Around: with pieces of what is around them.
  bool local_origin = false;       ///< Of splats.glb, as SplatGlbOptions.
};

/// What was painted into the holes, and follows the splats of the model.
struct WebFill {
  Gaussians splats;         ///< Tagged synthetic.
  PicturesBeside pictures;  ///< Of which they were made.
  double left_open = 0;     ///< Share of the holes, by pixels.
  /// As WebSplats::held_out, with these splats.
  std::optional<ViewFigures> held_out;
};

/// What write_web_splats() made.
struct WebSplats {
  ThinnedSplats thinned;
  size_t of = 0;  ///< Splats of the model.
  /// Mean of evaluate_views() with holes black, as browsers show them; empty where none was held
  /// out.
  std::optional<ViewFigures> held_out;
  std::optional<ViewFigures> held_out_of_all;  ///< Likewise, of the splats of the model.
  std::optional<WebFill> fill;                 ///< Empty if not asked for, or:
  std::string fill_left_out;                   ///< Why there is none, for people.
  size_t glb_bytes = 0;
  std::optional<SpzReport> spz;
  std::string spz_left_out;  ///< Why there is none, for people.
};

/// {"thinning": {…, "held_out", "held_out_of_all"}, "splats.glb": {…}, "splats.spz": {…}, "fill":
/// {…}, "left_out": {"splats.spz" or "fill": "why"}}, without what nobody asked for
nlohmann::ordered_json web_splats_to_json(const WebSplats& made);

/// Writes the splats of a model for viewers in browsers: splats.glb and splats.spz, thinned by
/// thin_splats(); SPZ tells places apart to a sixteenth of a pixel. Splats that reach too far for
/// SPZ are no reason to end a run: it is left out then.
/// The .glb says what the model rests on, and what vouches for each splat where that is stated; SPZ
/// has no place for these.
///
/// A fill is that of paint_surroundings(), merged as the others are; its pictures lie beside the
/// files. Where nothing can be painted, or photographs are cut out by masks, it is left out.
/// \param model  as before when this returns or throws
/// \throws Error as load_images()
WebSplats write_web_splats(const std::filesystem::path& folder,
                           Model& model,
                           const WebSplatsOptions& options = {},
                           const Progress& progress = {});

/// What was painted into the holes, as splats.glb holds it: WebFill::splats.
/// \param frame  of the model
/// \throws BadInput as read_splats()
Gaussians read_web_fill(const std::filesystem::path& folder, const Frame& frame);

}  // namespace cgs
