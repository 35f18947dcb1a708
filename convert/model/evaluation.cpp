// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/evaluation.h"

#include <algorithm>
#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/pictures.h"
#include "convert/model/views.h"
#include "convert/text/frame_json.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/exposure.h"
#include "libcgs/train/flip.h"
#include "libcgs/train/image_metrics.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// With black where nothing may be compared: windows beside it reach there.
ColorImage blackened(ColorImage image, const MaskMap& valid) {
  for (size_t i = 0; i < valid.data.size(); ++i) {
    if (valid.data[i] == 0) image.data[i] = Eigen::Vector3f::Zero();
  }
  return image;
}

double share_of(const MaskMap& part, const MaskMap& whole) {
  const auto count = [](const MaskMap& pixels) {
    return static_cast<double>(std::count(pixels.data.begin(), pixels.data.end(), 1));
  };
  return count(part) / count(whole);
}

EvaluatedView evaluate_view(const Model& model,
                            const std::vector<SupportView>& inputs,
                            const ModelPictures& pictures,
                            int index,
                            std::vector<std::string>& warnings) {
  View view = loaded_view(model.scene, index, /*with_image=*/true, warnings);
  const RenderBuffers buffers = render_camera(model, inputs, view.camera);
  const ColorImage shown = blackened(pictures.of(buffers, view.camera), view.valid);
  MaskMap seen = hole_mask(buffers);
  for (uint8_t& value : seen.data) value = 1 - value;
  const MaskMap everywhere(seen.width, seen.height, 1);
  const MaskMap all = intersection(everywhere, view.valid);
  const MaskMap use = intersection(seen, view.valid);
  EvaluatedView out;
  out.name = view.name;
  if (!model.scene.input.empty()) out.role = view_role(model.scene, index);
  if (is_exposed_otherwise(model, index)) {
    view.exposure = matching_gain(view.image, shown, use);
    apply_exposure(view);
    out.exposure = view.exposure;
  }
  const ColorImage photograph = blackened(view.image, view.valid);
  // The coarse scales of MS-SSIM mix what is masked with the rest, and count it as equal; the rim
  // that a lens leaves does not matter.
  constexpr double kNearlyWhole = 0.95;
  const auto has_any = [](const MaskMap& pixels) {
    return std::find(pixels.data.begin(), pixels.data.end(), 1) != pixels.data.end();
  };
  if (has_any(all)) {
    out.figures.psnr = psnr(shown, photograph, &all);
    out.figures.ssim = ssim(shown, photograph, &all);
    out.figures.flip = flip(shown, photograph, &all);
  }
  if (share_of(all, everywhere) >= kNearlyWhole) out.figures.ms_ssim = ms_ssim(shown, photograph);
  if (!knows_holes(model)) return out;
  if (has_any(use)) {
    out.figures.psnr_seen = psnr(shown, photograph, &use);
    out.figures.ssim_seen = ssim(shown, photograph, &use);
  }
  if (has_any(all)) out.figures.hole_fraction = 1 - share_of(use, all);
  return out;
}

// By their names in reports.
constexpr std::array<std::pair<const char*, std::optional<double> ViewFigures::*>, 7> kFigures = {
    {{"psnr", &ViewFigures::psnr},
     {"ssim", &ViewFigures::ssim},
     {"psnr_seen", &ViewFigures::psnr_seen},
     {"ssim_seen", &ViewFigures::ssim_seen},
     {"hole_fraction", &ViewFigures::hole_fraction},
     {"ms_ssim", &ViewFigures::ms_ssim},
     {"flip", &ViewFigures::flip}}};

ViewFigures mean_figures(const std::vector<const EvaluatedView*>& views) {
  ViewFigures mean;
  for (const auto& [name, figure] : kFigures) {
    double sum = 0;
    size_t count = 0;
    for (const EvaluatedView* view : views) {
      if (!(view->figures.*figure)) continue;
      sum += *(view->figures.*figure);
      ++count;
    }
    if (count > 0) mean.*figure = sum / static_cast<double>(count);
  }
  return mean;
}

// Of those views that say how well the model predicts, if there are any: it was trained on inputs.
ViewFigures mean_of(const std::vector<EvaluatedView>& views, std::vector<std::string>& warnings) {
  const auto is_input = [](const EvaluatedView& view) { return view.role == "input"; };
  const bool are_all_inputs = std::all_of(views.begin(), views.end(), is_input);
  if (are_all_inputs) {
    warnings.emplace_back(
        "only input views are evaluated: the model was trained on them, so that the figures say "
        "how well it fits, not how well it predicts");
  }
  std::vector<const EvaluatedView*> counted;
  for (const EvaluatedView& view : views) {
    if (!is_input(view) || are_all_inputs) counted.push_back(&view);
  }
  return mean_figures(counted);
}

std::optional<ViewFigures> mean_of_every_eighth(const std::vector<EvaluatedView>& views,
                                                const Scene& scene) {
  if (scene.kind != SceneKind::Llff) return std::nullopt;
  std::vector<const EvaluatedView*> counted;
  for (size_t i = 0; i < scene.views.size(); i += 8) {
    const auto found = std::find_if(views.begin(), views.end(), [&](const EvaluatedView& view) {
      return view.name == scene.views[i].name && view.role != "input";
    });
    if (found == views.end()) return std::nullopt;
    counted.push_back(&*found);
  }
  return mean_figures(counted);
}

// Those that have a photograph. \throws BadInput if none has
std::vector<int> with_photograph(const Scene& scene,
                                 const std::vector<int>& views,
                                 std::vector<std::string>& warnings) {
  std::vector<int> out;
  for (const int i : views) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.image_path.empty()) {
      warnings.push_back("view " + printable(view.name) +
                         " has no photograph and is not evaluated");
    } else {
      out.push_back(i);
    }
  }
  if (out.empty() && !is_folder(scene.folder)) {
    throw BadInput(Defect::Open,
                   scene.folder,
                   "the folder of the photographs is gone; --scene says where they are");
  }
  if (out.empty()) {
    throw BadInput(Defect::Empty, scene.folder, "no view to evaluate has a photograph");
  }
  return out;
}

}  // namespace

// The exposure of the model is that of its input views. Where these had to be matched, the other
// photographs of the scene were exposed by whatever they show.
bool is_exposed_otherwise(const Model& model, int view) {
  const Scene& scene = model.scene;
  const std::string role = view_role(scene, view);
  return role != "input" && std::any_of(scene.input.begin(), scene.input.end(), [&](int i) {
           const View& input = scene.views[static_cast<size_t>(i)];
           PhotoResponse response = input.response;
           response.is_grey = false;  // without colours, but exposed as the others
           return input.exposure != Eigen::Vector3f::Ones() || response != PhotoResponse{};
         });
}

Json figures_to_json(const ViewFigures& figures) {
  Json out;
  for (const auto& [name, figure] : kFigures) {
    out[name] = figures.*figure ? Json(*(figures.*figure)) : Json();
  }
  return out;
}

Json evaluation_to_json(const Evaluation& evaluation) {
  Json rows = Json::array();
  for (const EvaluatedView& view : evaluation.views) {
    Json row = {{"name", view.name}, {"role", role_to_json(view.role)}};
    row.update(figures_to_json(view.figures));
    row["exposure"] = view.exposure ? vector_to_json(view.exposure->cast<double>()) : Json();
    rows.push_back(row);
  }
  const auto& eighth = evaluation.every_eighth;
  Json out = {{"mean", figures_to_json(evaluation.mean)},
              {"every_eighth", eighth ? figures_to_json(*eighth) : Json()},
              {"views", rows}};
  if (evaluation.through_water) out["through_water"] = true;
  return out;
}

Evaluation evaluate_views(const Model& model,
                          const std::vector<int>& views,
                          const Progress& progress,
                          HoleFill fill) {
  Evaluation out;
  if (const std::string text = unknown_holes_warning(model); !text.empty()) {
    out.warnings.push_back(text);
  }
  const std::vector<int> shown = with_photograph(model.scene, views, out.warnings);
  const std::vector<SupportView> inputs = support_views(model);
  const ModelPictures pictures(model, {fill, /*through_water=*/true});
  out.through_water = model.scene.water.has_value();
  for (size_t k = 0; k < shown.size(); ++k) {
    report(progress, static_cast<double>(k) / static_cast<double>(shown.size()));
    out.views.push_back(evaluate_view(model, inputs, pictures, shown[k], out.warnings));
  }
  out.mean = mean_of(out.views, out.warnings);
  out.every_eighth = mean_of_every_eighth(out.views, model.scene);
  report(progress, 1);
  return out;
}

}  // namespace cgs
