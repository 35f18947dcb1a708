// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/web_splats.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/splats/splat_reports.h"
#include "io/bytes/atomic_file.h"
#include "io/scenes/scene_reader.h"
#include "io/splats/splat_glb.h"
#include "io/splats/splat_reader.h"
#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"
#include "libcgs/core/splat_selection.h"
#include "libcgs/core/up_axis.h"
#include "libcgs/priors/water.h"
#include "libcgs/splats/splat_merging.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// As many as the input views have Gaussians, in their order.
std::vector<size_t> counts_of_views(const Model& model) {
  std::vector<size_t> out;
  for (const ViewPriors& priors : model.priors) {
    size_t& count = out.emplace_back(0);
    for (size_t i = 0; i < priors.depth.data.size(); ++i) count += draws(priors, i) ? 1 : 0;
  }
  return out;
}

// All splats where photographs are gone, or of names that cameras.json cannot hold: there is
// nothing to judge by.
ThinnedSplats thinned_splats(const Model& model, const Progress& progress) {
  Scene scene = model.scene;
  const bool has_photographs = std::all_of(scene.input.begin(), scene.input.end(), [&](int i) {
    return !scene.views[static_cast<size_t>(i)].image_path.empty();
  });
  if (!has_photographs) {
    ThinnedSplats all;
    all.splats = model.gaussians;
    return all;
  }
  load_images(scene, scene.input);
  take_out_water(model.priors, scene);
  return thin_splats(model.gaussians, scene, counts_of_views(model), progress);
}

// As few as the others are, by the cameras that they were painted in.
Gaussians merged_fill(const PaintedHoles& made, const std::optional<float>& most_cost) {
  if (!most_cost) return made.fill.gaussians;
  std::vector<Camera> cameras;
  for (const PaintedView& view : made.painted.views) cameras.push_back(view.camera);
  return merge_splats(weigh_splats(made.fill.gaussians, cameras), {.most_cost = *most_cost}).splats;
}

/// Two sets change places for as long as this lives: a model is large to copy.
class Exchange {
 public:
  Exchange(Gaussians& a, Gaussians& b) : a_(a), b_(b) { std::swap(a_, b_); }
  ~Exchange() { std::swap(a_, b_); }
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

 private:
  Gaussians& a_;
  Gaussians& b_;
};

// Of the splats that are left: these are what it must stay hidden behind.
void fill_holes(Model& model, WebSplats& out, const Progress& progress) {
  if (!may_complete(model)) {
    out.fill_left_out = "masks cut out more than a quarter of the photographs";
    return;
  }
  try {
    const std::vector<Camera> cameras = surroundings_views(model, part_of(progress, 0, 0.2));
    const Exchange exchange(model.gaussians, out.thinned.splats);
    PaintedHoles made = paint_surroundings(model, cameras, part_of(progress, 0.2, 1));
    out.fill = WebFill{merged_fill(made, out.thinned.most_cost),
                       std::move(made.pictures),
                       open_share(made.fill),
                       {}};
  } catch (const NumericalError& error) {
    out.fill_left_out = error.what();
  }
}

// What the model rests on, of which these splats are no longer one per pixel; "" where nobody says.
std::string evidence_of_thinned(const Model& model, size_t kept) {
  const size_t all = model.gaussians.size();
  if (model.evidence.empty() || kept == all) return model.evidence;
  return model.evidence + "; thinned to " + std::to_string(kept) + " of " + std::to_string(all) +
         " Gaussians";
}

// How the splats of a model show what was held out.
std::optional<ViewFigures> held_out_figures(const Model& model, const Progress& progress) {
  if (model.scene.held_out.empty()) return std::nullopt;
  return evaluate_views(model, model.scene.held_out, progress, HoleFill::None).mean;
}

// The same with other splats in their place.
std::optional<ViewFigures> held_out_figures(Model& model,
                                            Gaussians& splats,
                                            const Progress& progress) {
  const Exchange exchange(model.gaussians, splats);
  return held_out_figures(model, progress);
}

}  // namespace

WebSplats write_web_splats(const std::filesystem::path& folder,
                           Model& model,
                           const WebSplatsOptions& options,
                           const Progress& progress) {
  const Frame& frame = model.scene.frame;
  const Eigen::Matrix3d y_up = y_up_from(frame.up);
  make_output_folder(folder);
  WebSplats out;
  const bool fills = options.fill == HoleFill::Around;
  const double thinned = fills ? 0.5 : 0.9;
  out.thinned = thinned_splats(model, part_of(progress, 0, thinned));
  out.of = model.gaussians.size();
  if (fills) fill_holes(model, out, part_of(progress, thinned, 0.9));
  out.held_out_of_all = held_out_figures(model, part_of(progress, 0.9, 0.93));
  out.held_out = held_out_figures(model, out.thinned.splats, part_of(progress, 0.93, 0.96));
  Gaussians filled;
  if (out.fill) {
    filled = out.thinned.splats;
    append(filled, out.fill->splats);
    out.fill->held_out = held_out_figures(model, filled, part_of(progress, 0.96, 1));
  }
  const Gaussians& shown = out.fill ? filled : out.thinned.splats;
  write_pictures_beside(folder, out.fill ? out.fill->pictures : PicturesBeside());
  const std::string evidence = with_synthetic(evidence_of_thinned(model, out.thinned.splats.size()),
                                              out.fill ? out.fill->splats.size() : 0);
  out.glb_bytes =
      write_splat_glb(folder / "splats.glb", shown, frame, {y_up, evidence, options.local_origin});
  try {
    constexpr double kOfPixel = 1.0 / 16;
    out.spz = write_spz(folder / "splats.spz",
                        shown,
                        frame,
                        {.finest = kOfPixel * double{out.thinned.pixel}, .y_up = y_up});
  } catch (const InvalidInput& error) {
    out.spz_left_out = error.what();
  }
  return out;
}

Gaussians read_web_fill(const std::filesystem::path& folder, const Frame& frame) {
  Gaussians out = read_splats(folder / "splats.glb", frame).gaussians;
  if (out.synthetic.empty()) return {};
  keep_only(out, std::vector<uint8_t>(out.synthetic));
  return out;
}

Json web_splats_to_json(const WebSplats& made) {
  Json thinning = thinning_to_json(made.thinned, made.of);
  thinning["held_out"] = made.held_out ? figures_to_json(*made.held_out) : Json();
  thinning["held_out_of_all"] =
      made.held_out_of_all ? figures_to_json(*made.held_out_of_all) : Json();
  Json out = {{"thinning", thinning}, {"splats.glb", {{"bytes", made.glb_bytes}}}};
  if (made.spz) {
    out["splats.spz"] = {{"bytes", made.spz->bytes},
                         {"fractional_bits", made.spz->fractional_bits},
                         {"clamped_splats", made.spz->clamped}};
  } else {
    out["left_out"]["splats.spz"] = made.spz_left_out;
  }
  if (made.fill) {
    const auto count = double(made.fill->splats.size());
    out["fill"] = {
        {"splats", made.fill->splats.size()},
        {"synthetic_fraction", count / (count + double(made.thinned.splats.size()))},
        {"open_fraction", made.fill->left_open},
        {"held_out", made.fill->held_out ? figures_to_json(*made.fill->held_out) : Json()}};
  } else if (!made.fill_left_out.empty()) {
    out["left_out"]["fill"] = made.fill_left_out;
  }
  return out;
}

}  // namespace cgs
